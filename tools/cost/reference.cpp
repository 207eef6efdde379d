#include "tools/cost/reference.h"

#include <filesystem>

#include "db/raster.h"
#include "tools/terrain_writer.h"

namespace patchwork::cli {

namespace {

constexpr int kSide = 1025;
constexpr double kStep = 10;  // metres

}  // namespace

Database make_reference(const std::string& folder, std::uint64_t memory) {
  const std::filesystem::path to(folder);
  const std::string file = (to / "reference.tif").string(), path = (to / "reference.pwk").string();
  const double size = (kSide - 1) * kStep;
  const TerrainFunction terrain({.extent = {0, 0, size, size}});
  const SurveyFacts facts =
      write_survey(terrain, {.geotransform = {0, kStep, 0, size, 0, -kStep}, .width = kSide, .height = kSide},
                   {.type = "Int16"}, file);
  Database db = Database::open_or_create(path, "", memory);
  db.import(RasterSource::open(file, {.accuracy = facts.accuracy}, ""),
            {.name = "reference", .memory = memory});
  return db;
}

}  // namespace patchwork::cli
