// A line of the page on numerics (tests/NUMERICS.md): the worst figure of a hard case beside its limit.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <string>

namespace patchwork {

/// Prints the line that tests/numerics collects, and fails where the worst is beyond the limit.
inline void report_case(const char* name, const std::string& what, std::uint64_t tries, double worst,
                        double limit, const char* unit) {
  std::printf("HARD CASE | %s | %s | %llu | %.3g | %.3g | %s\n", name, what.c_str(),
              static_cast<unsigned long long>(tries), worst, limit, unit);
  EXPECT_LE(worst, limit) << name << ": " << what;
}

/// The same for laws without a figure, at the end of the test that asserts them.
inline void report_law(const char* name, const std::string& what, std::uint64_t tries) {
  report_case(name, what, tries, testing::Test::HasFailure() ? 1 : 0, 0, "broken");
}

/// Prints a line for the naive form beside a case, and fails where that keeps the case's limit.
inline void report_control(const char* name, const std::string& what, std::uint64_t tries, double worst,
                           double limit, const char* unit) {
  std::printf("HARD CASE | %s | negative control: %s | %llu | %.3g | %.3g | %s\n", name, what.c_str(),
              static_cast<unsigned long long>(tries), worst, limit, unit);
  EXPECT_GT(worst, limit) << name << ": " << what;
}

}  // namespace patchwork
