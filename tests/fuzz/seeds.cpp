// Writes a few sound inputs of every fuzzer into a folder: fuzz_seeds DIR. The corpus keeps them, so that
// fuzzing starts from what our own encoders make.
#include <filesystem>
#include <fstream>

#include "db/lod_tree.h"
#include "db/payload.h"
#include "query/extract.h"
#include "query/wire.h"
#include "tests/grids.h"

namespace {

using namespace patchwork;
using Bytes = std::vector<std::byte>;

std::filesystem::path folder;

void write(const std::string& target, const std::string& name, std::initializer_list<int> head,
           std::span<const std::byte> bytes) {
  std::filesystem::create_directories(folder / target);
  std::ofstream out(folder / target / name, std::ios::binary);
  for (const int b : head) out.put(char(b));
  out.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
}

Bytes bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  const auto from = std::as_bytes(std::span(text));
  return {from.begin(), from.end()};
}

GridFile hilly(bool holes) {
  GridFile g{.width = 70, .height = 45, .type = GDT_Int16};
  if (holes) g.nodata = -9999;
  g.at = [holes](int i, int j) {
    return holes && i > 20 && i < 30 && j > 10 ? kHole : 100 + (i * i + 3 * j) % 90;
  };
  return g;
}

void payloads() {
  for (const bool holes : {false, true}) {
    Chunk c = make_chunk(GridShape(20, 12, true), 0, 0, 0);
    for (int k = 0; k < c.cols * c.rows; ++k) {
      c.codes.push_back(k * k % 300);
      if (holes) c.cells.push_back(std::uint8_t(k % 7 == 0 ? 0 : 15));
    }
    write("payload", holes ? "holes" : "plain", {18, 10, 0}, encode_chunk(c));
  }
}

void pages(const Database& db) {
  std::vector<LodEntry> entries;
  for (int k = 0; k < 40; ++k)
    entries.push_back({{k * 1.0, 0, k + 2.0, 3, 0, float(k)}, PatchId::make({1}, 0, k, 0)});
  LodTree tree = LodTree::build(entries);
  const Bytes page = tree.page_bytes(tree.take_dirty_pages().front()), header = tree.header_bytes();
  write("pages", "page", {0, 0}, page);
  const RecordRun run{{db.grids()[0].patches[0], db.grids()[0].patches[1]}, {}};
  write("pages", "records", {1, 1}, run.bytes());
  Bytes both = header;
  both.insert(both.end(), page.begin(), page.end());
  write("pages", "tree", {2, int(header.size())}, both);
}

void updates(const Database& db) {
  for (const double error : {0.0, 40.0})
    write("wire", error > 0 ? "coarse" : "fine", {},
          encode_update(db, {extract(db, {.error = error}).patches, {{5}}}));
}

void files(const GridFolder& grids) {
  const std::string tif = grids.write(heights("1 2 3 4 / 5 6 7 8 / 9 10 11 12"), "small");
  write("import", "tif", {0}, bytes_of(tif));
  const auto convert = [&](const char* format, const std::string& to, int number, const std::string& name) {
    const GDALDatasetUniquePtr from(GDALDataset::Open(tif.c_str()));
    GDALClose(GetGDALDriverManager()->GetDriverByName(format)->CreateCopy(grids.path(to).c_str(), from.get(),
                                                                          FALSE, nullptr, nullptr, nullptr));
    write("import", name, {number}, bytes_of(grids.path(to)));
  };
  convert("AAIGrid", "out.asc", 1, "asc"), convert("XYZ", "out.xyz", 5, "xyz"),
      convert("PNG", "out.png", 6, "png");
  write("import", "holes.tif", {0}, bytes_of(grids.write(hilly(true), "holes")));
}

void scenes() {
  const std::string texts[] = {
      R"({"camera": {"eye": [1, 2, 300], "look": [5, 6, 7], "fov": 50}, "size": [64, 36], "pixel_error": 2})",
      R"({"path": {"points": [[0, 0, 9], [100, 0, 9]], "speed_m_s": 40, "frames": 3}, "smoothness": 2,
          "effects": {"sun": {"azimuth": 200}, "shadow": {}, "water": {"level": -3.5}, "contours": {"interval": 25}}})"};
  int n = 0;
  for (const std::string& t : texts)
    write("scene", "scene" + std::to_string(++n), {}, std::as_bytes(std::span(t)));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  folder = argv[1];
  const GridFolder grids;
  Database db = grids.database();
  grids.add(db, hilly(true), "grid");
  payloads(), pages(db), updates(db), files(grids), scenes();
  return 0;
}
