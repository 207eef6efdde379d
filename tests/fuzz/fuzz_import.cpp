// Files of common formats through GDAL: refused, or rows that can be read and a grid that can be stored.
#include <gdal_priv.h>
#include <unistd.h>

#include <filesystem>

#include "db/database.h"
#include "db/error.h"
#include "tests/fuzz/fuzz.h"

namespace {

using namespace patchwork;

constexpr const char* kFormats[] = {"GTiff", "AAIGrid", "SRTMHGT", "USGSDEM", "DTED",
                                    "XYZ",   "PNG",     "EHdr",    "MEM"};
constexpr const char* kNames[] = {"in.tif", "in.asc", "N46W122.hgt", "in.dem", "in.dt0", "in.xyz", "in.png"};
constexpr int kMostSamples = 1 << 16;

void only_common_formats() {
  try {
    RasterSource::open("/vsimem/none", {}, "");  // registers all formats, once
  } catch (const Error&) {
  }
  // GDAL must not miss them, nor a leak checker: the list stays until the very end.
  static std::vector<GDALDriver*>& others = *new std::vector<GDALDriver*>;
  GDALDriverManager& all = *GetGDALDriverManager();
  for (int k = all.GetDriverCount() - 1; k >= 0; --k) {
    GDALDriver* const driver = all.GetDriver(k);
    bool common = false;
    for (const char* f : kFormats) common |= std::string(f) == driver->GetDescription();
    if (!common) others.push_back(driver), all.DeregisterDriver(driver);
  }
  CPLSetErrorHandler(CPLQuietErrorHandler);
}

void import(const std::string& path) {
  const RasterSource source = RasterSource::open(path, {.accuracy = 1}, "");
  if (std::int64_t{source.width()} * source.height() > kMostSamples) return;
  std::vector<double> row(std::size_t(source.width()));
  for (int j = 0; j < source.height(); ++j) source.read_rows(j, 1, row);
  static const std::string to =
      (std::filesystem::temp_directory_path() / ("fuzz-" + std::to_string(getpid()))).string();
  for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(to + end);
  Database db = Database::open_or_create(to, "");
  db.import(source, {.name = "grid"});
  fuzz::require(db.check().empty(), "what is imported is sound");
  for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(to + end);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool once = (only_common_formats(), true);
  if (!once || size < 2) return 0;
  const std::string path = std::string("/vsimem/") + kNames[data[0] % std::size(kNames)];
  VSIFCloseL(VSIFileFromMemBuffer(path.c_str(), const_cast<GByte*>(data + 1), size - 1, FALSE));
  try {
    import(path);
  } catch (const Error&) {
  }
  VSIUnlink(path.c_str());
  return 0;
}
