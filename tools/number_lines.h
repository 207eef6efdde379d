// Lines of numbers as people have them: in columns, with or without a header.
#pragma once

#include <cstddef>
#include <istream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace patchwork::cli {

/// The numbers of some columns, line after line. Fields lie between tabs, else between semicolons, else
/// between commas, where empty ones count; else between blanks; quoted ones may hold what else parts them.
/// Without a header, just as many numbers as columns may be parted by any of these, each by its own. Empty
/// lines and those that begin with # are left out, and so is a mark of UTF-8.
class NumberLines {
 public:
  /// Names by which a header may call a column, lower case.
  using Names = std::vector<std::string_view>;

  /// Without a header the columns are the first ones, in this order; with one, the first of each name that is
  /// not taken already. REQUIRES: `in` outlives it.
  NumberLines(std::istream& in, std::vector<Names> columns);
  /// One number a column; false at the end. Throws Error: the line that has not got them, a header that does
  /// not name them all, input that cannot be read to its end. REQUIRES: as many values as columns.
  bool next(std::span<double> values);

 private:
  bool is_header(std::string_view line);

  std::istream& in_;
  std::vector<Names> names_;
  std::vector<std::size_t> places_;  // of the columns
  std::string line_;
  std::size_t number_ = 0;
  bool begun_ = false, named_ = false;  // the columns, by a header
};

}  // namespace patchwork::cli
