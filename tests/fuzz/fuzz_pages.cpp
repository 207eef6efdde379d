// Pages of the R-tree, its header, and runs of patch records: sound or refused, and equal when written again.
#include "db/error.h"
#include "db/lod_tree.h"
#include "db/patch_records.h"
#include "tests/fuzz/fuzz.h"

namespace {

using namespace patchwork;
using Bytes = std::vector<std::byte>;

void page(const Bytes& bytes) {
  std::string problem;
  const LodPage p = LodPage::from_bytes(bytes, problem);
  if (!problem.empty()) return;
  fuzz::require(p.count <= LodPage::kSlots, "a page has 64 slots");
  for (std::uint32_t s = 0; s < p.count; ++s) fuzz::require(p.box(s).sound(), "boxes are sound");
  fuzz::require(p.bytes() == bytes, "a page is written as it was read");
}

void records(const Bytes& bytes, std::size_t patches) {
  std::string problem;
  const RecordRun run = RecordRun::from_bytes(bytes, 0, patches, problem);
  if (problem.empty()) fuzz::require(run.bytes() == bytes, "a run is written as it was read");
}

// A tree all of whose pages are the same bytes: it must end, and not in a ring.
void tree(const Bytes& header, const Bytes& pages) {
  try {
    const LodTree t = LodTree::open(header, [&](std::uint32_t) { return pages; });
    std::size_t seen = 0;
    t.visit_uniform({-1e9, -1e9, 1e9, 1e9}, 1, [&](const LodEntry&) {
      if (++seen > 5000) throw Error("tree", "enough");
    });
  } catch (const Error&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const int kind = input.byte() % 3, split = input.byte();
  const Bytes bytes(input.rest().begin(), input.rest().end());
  const std::size_t at = std::min(bytes.size(), std::size_t(split));
  if (kind == 0) page(bytes);
  if (kind == 1) records(bytes, std::size_t(split) + 1);
  if (kind == 2)
    tree(Bytes(bytes.begin(), bytes.begin() + std::ptrdiff_t(at)),
         Bytes(bytes.begin() + std::ptrdiff_t(at), bytes.end()));
  return 0;
}
