// patchwork check: is everything in a database as it must be, and can it be set right.
#include <fmt/format.h>

#include <filesystem>

#include "db/error.h"
#include "tools/cli.h"

namespace patchwork::cli {

namespace {

Json json_of(const std::vector<Problem>& problems) {
  Json list = Json::array();
  for (const Problem& p : problems) list.push_back({{"what", p.what}, {"where", p.where}});
  return list;
}

void tell(const std::string& path, const std::vector<Problem>& problems, Json document,
          const Common& common) {
  document["sound"] = problems.empty(), document["problems"] = json_of(problems);
  if (common.json) print(document);
  for (const Problem& p : problems)
    if (!common.json) fmt::print("{}: {}\n", p.where, p.what);
  if (!problems.empty()) throw Error(path, fmt::format("it has {} problems", problems.size()));
  if (!common.json && !common.quiet) fmt::print("{}: sound\n", path);
}

void run(const std::string& path, bool repair, const Common& common) {
  ProgressBar bar(common, "check");
  const auto show = [&](double share) { bar.show(share); };
  if (!repair) {
    std::vector<Problem> problems;
    try {
      problems = Database::open(path, common.memory).check(show);
    } catch (const Error& e) {
      if (!std::filesystem::is_regular_file(path)) throw;
      problems = {{e.problem(), "file"}};
    }
    return tell(path, problems, Json::object(), common);
  }
  Database db = Database::open_existing(path, common.memory);
  const RepairReport r = db.repair(show);
  if (!common.json && !common.quiet)
    fmt::print(
        "{}: {}\n", path,
        r.done ? fmt::format("the R-tree was made anew, {} tops or flags set right, {} stray blobs dropped",
                             r.records, r.strays)
               : "nothing was changed, because patch records cannot be read");
  tell(path, r.remaining, {{"repaired", {{"done", r.done}, {"records", r.records}, {"strays", r.strays}}}},
       common);
}

}  // namespace

void add_check(CLI::App& app, Common& common) {
  auto path = std::make_shared<std::string>();
  auto repair = std::make_shared<bool>(false);
  CLI::App* v = verb(app, common, "check", "verify a database: file, heights, invariant, R-tree");
  v->add_option("DB", *path, "the database")->required();
  v->add_flag("--repair", *repair, "make anew what can be derived: tops, flags and R-tree");
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([path, repair, &common] { run(*path, *repair, common); });
}

}  // namespace patchwork::cli
