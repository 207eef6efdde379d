// From a camera to a picture: selects tiles, makes those that are missing, draws.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "blend/blend.h"
#include "blend/vulkan/device.h"
#include "blend/vulkan/vulkan_blend.h"
#include "render/camera.h"
#include "render/picture.h"
#include "render/scene.h"
#include "render/tile_cache.h"

namespace patchwork {

struct TileDraw;
struct MeshVertex;
namespace vk {
struct FrameBlock;
class Target;
struct TileStore;
}  // namespace vk

/// How tiles become triangles that keep to the pixel error. Each may be drawn as any other: pictures agree to
/// within twice that error.
enum class Tessellation {
  hardware,   ///< the card's stages, block by block: vulkan/tessellation.cpp
  mesh,       ///< compute shaders, vertex by vertex, fewer triangles but more work a tile: vulkan/mesh.cpp
  published,  ///< hardware as it was published, without the guarantee: vulkan/factors.comp
};

struct RendererOptions {
  int width = 1280, height = 720;  ///< pixels
  double pixel_error = 1;          ///< pixels
  int smoothness = 1;              ///< k
  Composition composition = Composition::priority;
  double far =
      std::numeric_limits<double>::infinity();  ///< metres along the line of sight; tiles beyond are left out
  std::size_t memory = std::size_t{512} << 20;  ///< bytes on the card: half for tiles, half for patches
  TilePolicy policy = TilePolicy::lru;          ///< the fastest of `patchwork bench tiles`
  Color background{0xbf, 0xd4, 0xe8};
  /// Frames do not wait: missing tiles are read by workers and made within make_ms a frame.
  bool realtime = false;
  double make_ms = 8;
  int workers = 1;
  /// None: the mesh where the device is a CPU, which draws it in about two thirds of the time; else hardware.
  std::optional<Tessellation> tessellation = {};
  SceneEffects effects = {};  ///< what is not there costs no shader, buffer or dispatch
  bool legend = true;         ///< drawn into picture() where an effect has a scale
};

/// What a frame did and reached. Milliseconds.
struct FrameStats {
  double select_ms = 0, extract_ms = 0, send_ms = 0, blend_ms = 0, finish_ms = 0;  ///< on the host
  double light_ms = 0, factors_ms = 0, draw_ms = 0;                                ///< on the card
  double total_ms = 0;
  std::size_t tiles_drawn = 0, tiles_made = 0,
              tiles_wanted = 0;  ///< wanted: still missing, with room for them
  std::size_t tiles_coarse = 0;  ///< drawn above the asked error, because finer ones are not there yet
  std::size_t tiles_stale = 0;   ///< drawn as the database was, because they are not made anew yet
  bool workers_held = false;     ///< the database is about to move
  std::size_t patches_sent = 0, bytes_up = 0;
  std::size_t dispatches = 0, draws = 0;  ///< the blend's own not counted; draws of the indirect calls
  std::uint64_t triangles = 0;            ///< 0 where the device does not count
  double pixels_asked = 0, pixels_reached = 0;
  double bound_max = 0;                                   ///< metres: of all heights drawn
  bool front_only = false;                                ///< what looks away was known to be hidden
  bool redrawn = false;                                   ///< else the picture is that of the frame before
  BlendCounts blended;                                    ///< of the tiles made
  BlockShares blocks;                                     ///< the same: inside are copied, partial blended
  std::size_t shadow_dispatches = 0, sky_dispatches = 0;  ///< of the light map
  std::size_t light_texels = 0, light_left = 0;  ///< of it made; heights and texels that are still to come
};

/// One picture at a time. Not safe for concurrent use.
class Renderer {
 public:
  static constexpr double kNear = 0.1;  ///< metres

  /// REQUIRES: `db` outlives it. Throws Error: a device that does not draw, no memory, nothing to draw.
  Renderer(std::shared_ptr<Device> device, const Database& db, const RendererOptions& options);
  ~Renderer();

  /// Waits until all that the picture needs is there, unless it is realtime. A frame whose input
  /// is that of the one before is not drawn again: see FrameStats::redrawn. Throws Error: the device's
  /// memory, damaged payloads.
  FrameStats draw(const Camera& camera);
  /// Other effects from the next picture on, of the same kinds of overlay; what stays valid is kept. Throws
  /// Error: an overlay of bounds or sources that the renderer was not made with.
  void change(const SceneEffects& effects);
  /// What was drawn last, read from the card when asked for.
  Image picture() const;
  /// Metres along the ray through each pixel's centre, row-major; NaN where there is sky.
  std::vector<float> depth() const;

  /// Moves the database that it draws to its newest state; false if it is in it. Tiles that changes touch are
  /// made anew, all others stay as they are. REQUIRES: `db` is the constructor's.
  bool refresh(Database& db);
  /// What was drawn last, for those who draw it in another way.
  struct Drawn {
    const vk::TileStore& store;
    const vk::FrameBlock& frame;
    std::span<const TileDraw> draws;
  };
  Drawn drawn() const;
  Tessellation tessellation() const;
  /// Three vertices (tile_seams.h) for each triangle of the last frame, seen or clipped, counterclockwise
  /// from above; none but with Tessellation::mesh.
  std::vector<MeshVertex> mesh() const;
  /// From the next frame on: another size of the picture (pixels, at least 1 x 1), another error. Tiles stay.
  void reshape(int width, int height, double pixel_error);
  /// Of the error or cost overlay, as drawn last. Kept, it holds for all pictures until the effects or the
  /// size change: what is compared shares one scale.
  ValueScale overlay_scale() const;
  void keep_scale();
  /// Onto a picture of any size: what picture() has of a legend.
  void draw_legend(Image& picture) const;
  const TileCache& cache() const;
  const TileLattice& lattice() const;
  std::vector<TileKey> tiles() const;  ///< the last frame's tiles
  const vk::Target& target() const;    ///< what was drawn last, ready to be copied from: vulkan/target_impl.h

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork
