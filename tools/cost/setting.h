// One setting of a knob that a surface has: what it answers, and one run of it.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <tuple>

#include "blend/vulkan/device.h"
#include "query/extract.h"
#include "tools/cost/check_points.h"
#include "tools/cost/rounds.h"

namespace patchwork::cli {

/// Ready to be measured. What it points to outlives it.
struct Setting {
  std::string knob, value;
  std::string unit = "m";  ///< of `asked`, and of errors
  double asked = 0;
  std::shared_ptr<const CutSurface> cut;  ///< of *db
  Extent window{};                        ///< of the raster that is evaluated, side x side pixels
  std::span<const double> scale{};        ///< see CheckPoints::compare
  const Database* db = nullptr;
  const CheckPoints* points = nullptr;
  BlendOptions blend{};
  bool vulkan = false;
  bool comparable = true;  ///< with what the model expects, which knows the best blend on all threads alone
  int tile = 64;           ///< pixels along each side, of the engine vulkan
  int side = 0, threads = 0;

  /// But for the names of knob and value.
  bool same_work(const Setting& o) const {
    const auto all = [](const Setting& s) {
      return std::tuple(s.unit, s.asked, s.window.xmin, s.window.ymin, s.window.xmax, s.window.ymax, s.db,
                        s.blend.smoothness, s.blend.composition, s.vulkan, s.vulkan ? s.tile : 0, s.side,
                        s.threads);
    };
    return all(*this) == all(o);
  }
};

/// All settings on one machine.
class Surfaces {
 public:
  /// `device`: none, or what vulkan asks for. `memory`: bytes that the user gives; `cache`: of databases, so
  /// that all of an answer stays there.
  Surfaces(std::shared_ptr<Device> device, std::uint64_t memory, std::uint64_t cache)
      : device_(std::move(device)), memory_(memory), cache_(cache) {}

  /// What it answers, and how far that lies from the best.
  CostRow facts(const Setting& s) const;
  /// From a database of which nothing is in memory yet.
  void once(const Setting& s, Stages& ms) const;

 private:
  std::unique_ptr<Evaluator> evaluator(const Setting& s, const Database& db, const Extraction& x) const;
  std::shared_ptr<Device> device_;
  std::uint64_t memory_, cache_;
};

}  // namespace patchwork::cli
