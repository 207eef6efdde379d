// patchwork import: grids into a database, each in one transaction.
#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "db/error.h"
#include "tools/cli.h"
#include "tools/compare.h"
#include "tools/unfinished_files.h"

namespace patchwork::cli {

namespace {

struct Options {
  std::string database, name, crs, replace;
  double tolerance = 0;
  std::vector<std::string> files;
  RasterOptions raster;
  bool join = false, dry_run = false;
};

RasterSource open_source(const Options& o, const std::vector<std::string>& files, const std::string& crs) {
  return files.size() > 1 ? RasterSource::open_joined(files, o.raster, crs)
                          : RasterSource::open(files.front(), o.raster, crs);
}

Json json_of(const ImportReport& r, const std::vector<std::string>& warnings,
             const std::optional<Comparison>& compared) {
  Json g{{"name", r.name},
         {"accuracy", r.accuracy},
         {"patches", r.patches},
         {"seconds", r.seconds.total},
         {"warnings", warnings},
         {"dormant", r.dormant},
         {"hidden", r.hidden},
         {"lowered", r.lowered},
         {"removed", r.removed},
         {"woken", r.woken},
         {"quantisation", r.quantisation},
         {"extent", to_json(r.extent)}};
  g["stages"] = {{"read", r.seconds.scan},
                 {"errors", r.seconds.errors},
                 {"encode", r.seconds.encode},
                 {"invariant", r.seconds.invariant},
                 {"store", r.seconds.store}};
  if (!r.duplicate_of.empty()) g["duplicate_of"] = r.duplicate_of;
  if (compared)
    g["against_database"] = {{"offset", compared->offset},
                             {"tilt_x", compared->tilt_x},
                             {"tilt_y", compared->tilt_y},
                             {"spread", compared->spread},
                             {"points", compared->points}};
  return g;
}

std::string text_of(const ImportReport& r, bool dry_run, const std::optional<Comparison>& compared) {
  if (!r.duplicate_of.empty())
    return fmt::format("{}: the same grid is there as {} already; nothing to do", r.name, r.duplicate_of);
  std::string text = fmt::format(
      "{}: {} {} patches ({} redundant), {} of other grids hidden, {} shortened; accuracy {:g} m{}; {:.2f} s",
      r.name, dry_run ? "would add" : "added", r.patches, r.dormant, r.hidden, r.lowered, r.accuracy,
      r.quantisation > 0 ? fmt::format(", stored to within {:g} m", r.quantisation) : "", r.seconds.total);
  text += "\n  where: " + to_text(r.extent);
  if (compared)
    text += fmt::format(
        "\n  against what is there: offset {:+.2f} m, tilt {:+.3f} m/km in x and {:+.3f} m/km in y, spread "
        "{:.2f} m ({} points)",
        compared->offset, 1000 * compared->tilt_x, 1000 * compared->tilt_y, compared->spread,
        compared->points);
  return text;
}

class ImportRun {
 public:
  ImportRun(const Options& options, const Common& common) : o_(options), common_(common) {}

  void run() {
    const bool one_grid = o_.files.size() == 1 || o_.join;
    if (!o_.name.empty() && !one_grid)
      throw CLI::ValidationError("--name", "it can name one grid only; give one file or --join");
    if (!o_.replace.empty() && !one_grid)
      throw CLI::ValidationError("--replace", "one grid takes the place of one; give one file or --join");
    std::vector<std::vector<std::string>> sets;
    if (o_.join)
      sets.push_back(o_.files);
    else
      for (const std::string& f : o_.files) sets.push_back({f});
    Json grids = Json::array();
    try {
      for (const auto& files : sets) grids.push_back(one(files));
    } catch (...) {
      if (common_.json && !grids.empty()) print({{"grids", grids}});
      throw;
    }
    if (common_.json) print({{"grids", grids}});
  }

 private:
  Json one(const std::vector<std::string>& files) {
    std::optional<Database> db;
    if (std::filesystem::exists(o_.database)) db = Database::open_or_create(o_.database, "", common_.memory);
    const bool settled = db && (!db->grids().empty() || !db->crs().empty());
    if (settled && !o_.crs.empty() && db->crs() != o_.crs && !same_crs(db->crs(), o_.crs))
      throw Error(o_.database, "its CRS is not " + o_.crs, "leave --crs out, or make another database");
    const RasterSource source = open_source(o_, files, settled ? db->crs() : o_.crs);
    if (settled && db->crs().empty() && !source.crs().empty())
      throw Error(files.front(), "it has a CRS and the database has none: their places cannot be compared",
                  "make a database with --crs and import its grids there");
    for (const std::string& w : source.warnings()) note(common_, files.front() + ": " + w);
    // A database that this run makes goes with an interrupt, too, if it is empty and as long as nobody else
    // can write to it: while the import's progress is between 0 and 1.
    const std::string& path = o_.database;
    UnfinishedFiles made({path, path + "-wal", path + "-shm"}, UnfinishedFiles::Fate::open);
    if (!settled) db = Database::open_or_create(path, "", common_.memory);  // the CRS comes with the grid
    if (!db->made_file()) made.keep();
    std::optional<Comparison> compared;
    ImportReport report;
    try {
      if (o_.dry_run) compared = compare(*db, source);
      report = import(*db, source, files, made);
    } catch (...) {
      made.set(UnfinishedFiles::Fate::open);
      if (db->made_file()) db->remove_if_empty();
      made.keep();
      throw;
    }
    if (o_.dry_run && db->made_file()) db->remove_if_empty();
    made.keep();
    std::vector<std::string> warnings = source.warnings();
    if (report.quantisation > std::max(report.accuracy, o_.tolerance)) {
      warnings.push_back(fmt::format(
          "its heights reach so far that they are stored to within {:g} m only; a value that means no "
          "data is given with --nodata",
          report.quantisation));
      note(common_, files.front() + ": " + warnings.back());
    }
    if (!common_.json && !common_.quiet) fmt::print("{}\n", text_of(report, o_.dry_run, compared));
    return json_of(report, warnings, compared);
  }

  ImportReport import(Database& db, const RasterSource& source, const std::vector<std::string>& files,
                      UnfinishedFiles& made) const {
    const std::string stem = std::filesystem::path(files.front()).stem().string();
    const std::string name = !o_.name.empty() ? o_.name : !o_.replace.empty() ? o_.replace : stem;
    const double megasamples = double(source.width()) * source.height() / 1e6;
    ProgressBar bar(common_, "import " + name, megasamples, "Msamples");
    return db.import(source, {.name = name,
                              .memory = common_.memory,
                              .dry_run = o_.dry_run,
                              .tolerance = o_.tolerance,
                              .replace = o_.replace,
                              .progress = [&](double share) {
                                if (share == 0 && db.grids().empty()) made.set(UnfinishedFiles::Fate::remove);
                                if (share == 0 && !db.grids().empty()) made.keep();
                                if (share == 1) made.set(UnfinishedFiles::Fate::open);
                                bar.show(share);
                              }});
  }

  const Options& o_;
  const Common& common_;
};

}  // namespace

void add_import(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v = verb(app, common, "import", "add height grids to a database");
  v->add_option("DB", o->database, "the database; made if it is not there")->required();
  v->add_option("FILE", o->files, "height grids in any format that GDAL reads")->required();
  v->add_option("--accuracy", o->raster.accuracy, "largest error of the grid's surface, metres")
      ->check(zero_or_more());
  v->add_option("--name", o->name,
                "of the grid; else that of the grid it replaces, else the file's name without its ending");
  v->add_option("--replace", o->replace, "a grid of the database that goes out as this one comes in")
      ->check(not_empty());
  v->add_option(
       "--tolerance", o->tolerance,
       "metres by which a stored height may differ from the file's; 0 keeps integers exactly, and other "
       "heights exactly or to within a 32nd of the accuracy")
      ->check(zero_or_more());
  v->add_option("--crs", o->crs, "CRS of a new database, e.g. EPSG:32610; projected, in metres");
  v->add_option("--band", o->raster.band, "band that holds the heights, from 1");
  v->add_option("--nodata", o->raster.nodata, "a further value that means no data (may be repeated)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  v->add_option("--unit", o->raster.unit, "unit of the heights")
      ->check(CLI::IsMember({"m", "ft", "us-ft", "cm"}));
  v->add_option("--vertical-offset", o->raster.vertical_offset, "metres added to every height")
      ->check(finite());
  v->add_flag("--join", o->join, "the files are tiles of one grid");
  v->add_flag("--dry-run", o->dry_run, "say what would change, each file by itself, and keep nothing");
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { ImportRun(*o, common).run(); });
}

}  // namespace patchwork::cli
