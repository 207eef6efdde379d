// patchwork selftest: hard cases on a database of one's own.
#include "tools/selftest/selftest.h"

#include <fmt/format.h>
#include <gdal.h>

#include "db/error.h"
#include "tools/cli.h"

namespace patchwork::cli {

namespace {

Json json_of(const Verdict& v) {
  return {{"case", v.name},   {"law", v.law},   {"tries", v.tries},   {"worst", v.worst},
          {"limit", v.limit}, {"unit", v.unit}, {"holds", v.holds()}, {"left_out", v.left_out}};
}

void print_table(const std::vector<Verdict>& all) {
  fmt::print("{:<23} {:>9} {:>10} {:>10}  {:<15} verdict\n", "case", "tries", "worst", "limit", "");
  for (const Verdict& v : all) {
    const char* verdict = !v.left_out.empty() ? "left out" : v.holds() ? "holds" : "DOES NOT HOLD";
    fmt::print("{:<23} {:>9} {:>10.3g} {:>10.3g}  {:<15} {}\n", v.name, v.tries, v.worst, v.limit, v.unit,
               verdict);
    if (!v.left_out.empty()) fmt::print("  {}\n", v.left_out);
    if (!v.holds()) fmt::print("  {}\n", v.law);
  }
}

void run(const std::string& path, SelfTestOptions options, const Common& common) {
  GDALAllRegister();
  options.memory = common.memory;
  const Database db = open_filled(path, common);
  ProgressBar bar(common, "selftest");
  const std::vector<Verdict> all = run_selftest(db, options, [&](double share) { bar.show(share); });
  int broken = 0;
  for (const Verdict& v : all) broken += !v.holds();
  if (common.json) {
    Json list = Json::array();
    for (const Verdict& v : all) list.push_back(json_of(v));
    print({{"sound", broken == 0}, {"seed", options.seed}, {"cases", list}});
  } else if (!common.quiet) {
    print_table(all);
  }
  if (broken > 0)
    throw Error(path, fmt::format("{} of {} cases do not hold", broken, all.size()),
                "a bound that is left names a grid that is less accurate than --accuracy said");
}

}  // namespace

void add_selftest(CLI::App& app, Common& common) {
  auto path = std::make_shared<std::string>();
  auto o = std::make_shared<SelfTestOptions>();
  CLI::App* v =
      verb(app, common, "selftest", "numerical hard cases tried on a database; exit 1 if one fails");
  v->add_option("DB", *path, "the database, which is only read")->required();
  v->add_option("--tries", o->tries, "points or places of each case")
      ->check(CLI::Range(100, 100'000'000))
      ->capture_default_str();
  v->add_option("--seed", o->seed, "of everything random")->capture_default_str();
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([path, o, &common] { run(*path, *o, common); });
}

}  // namespace patchwork::cli
