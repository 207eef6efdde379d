#include "render/renderer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "db/error.h"
#include "db/stopwatch.h"
#include "query/cut.h"
#include "render/tile_seams.h"
#include "render/tile_supply.h"
#include "render/vulkan/terrain_pass_impl.h"

namespace patchwork {

namespace {

const Device::Impl& drawing(const Device& device) {
  if (!device.impl().cannot_draw.empty())
    throw Error(device.name(), "it cannot draw: " + device.impl().cannot_draw,
                "PATCHWORK_DEVICE picks another device");
  return device.impl();
}

void put_matrix(const glm::dmat4& m, float (&to)[16]) {
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r) to[4 * c + r] = float(m[c][r]);
}

// What the effects look at of the options.
Scene scene_of(const RendererOptions& o) {
  Scene s;
  s.width = o.width, s.height = o.height, s.smoothness = o.smoothness;
  s.background = o.background, s.legend = o.legend, s.effects = o.effects;
  return s;
}

// Where one frame took 2.5 s when shadow and sky were switched on, 266 take 129 ms each instead of 93
// (`patchwork bench effects`, 1025 x 1025 samples, two cores of lavapipe).
vk::LightBudget light_budget(const RendererOptions& o) {
  return o.realtime ? vk::LightBudget{.ms = 4, .rays = 8192} : vk::LightBudget{};
}

// The options with a way to tessellate that the device has.
RendererOptions resolved(RendererOptions o, const Device::Impl& device) {
  const bool mesh = device.features.fullDrawIndexUint32 != 0;
  if (o.tessellation == Tessellation::mesh && !mesh)
    throw Error("tessellation", "the device has no vertices with numbers of 32 bits, as a mesh needs",
                "hardware does without");
  if (!o.tessellation) {
    const bool cpu = device.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    o.tessellation = cpu && mesh ? Tessellation::mesh : Tessellation::hardware;
  }
  return o;
}

// Where terrain is without gaps, and convex.
struct Ground {
  Frame frame;
  LatticeRect samples;
  bool holds(Point p) const {
    const Point at = frame.to_lattice(p.x, p.y);
    return samples.i0 <= at.x && at.x <= samples.i1 && samples.j0 <= at.y && at.y <= samples.j1;
  }
};

// That of a grid without holes which holds all others, to a hair of its cells, if there is one.
std::optional<Ground> ground_of(const Database& db) {
  constexpr double kHair = 1e-6;
  const auto holds = [](double low, double high, double a, double b, double hair) {
    return low - hair <= a && b <= high + hair;
  };
  const Extent all = db.grids().empty() ? Extent{} : db.extent();
  for (const Grid& g : db.grids()) {
    const Frame& f = g.info.frame;
    const Extent e = g.info.bounds();
    const double hair = kHair * f.finer_step();
    if (g.info.holes || !holds(e.xmin, e.xmax, all.xmin, all.xmax, hair) ||
        !holds(e.ymin, e.ymax, all.ymin, all.ymax, hair))
      continue;
    const LatticeRect own = g.info.shape.footprint();
    const bool holds_all = std::all_of(db.grids().begin(), db.grids().end(), [&](const Grid& o) {
      const LatticeRect r = f.lattice_bounds(o.info.frame.corners(o.info.shape.footprint()));
      return holds(own.i0, own.i1, r.i0, r.i1, kHair) && holds(own.j0, own.j1, r.j0, r.j1, kHair);
    });
    if (holds_all) return Ground{f, g.info.shape.samples()};
  }
  return {};
}

bool knowing(const SceneEffects& e) { return e.error || e.source; }

vk::TileStore::Holds holds(const RendererOptions& o) {
  return {.knowledge = knowing(o.effects), .meshes = o.tessellation == Tessellation::mesh};
}

}  // namespace

struct Renderer::Impl {
  std::shared_ptr<Device> device;
  const Database& db;
  const Device::Impl& card;
  RendererOptions options;
  TileLattice lattice;
  double base;  // the middle of all heights, where float32 loses least
  vk::TileStore store;
  TileSupply supply;
  vk::Target target;
  vk::TerrainPass terrain;
  vk::FrameEffects effects;
  vk::Commands commands;
  vk::Timer timer;
  vk::OwnedQueries counter;
  std::vector<TileDraw> draws, last_draws;
  vk::FrameBlock block{};
  Camera camera;
  std::optional<Ground> ground;
  bool drawn = false;
  bool holding = false;  // the workers, until none of them reads

  Impl(std::shared_ptr<Device> d, const Database& database, const RendererOptions& o)
      : device(std::move(d)),
        db(database),
        card(drawing(*device)),
        options(resolved(o, card)),
        lattice(TileLattice::over(db)),
        base(db.heights().middle()),
        store(card, vk::TileStore::slots_within(card, o.memory / 2, holds(options)), holds(options)),
        supply(device, db, lattice, store, base, options),
        target(card, std::uint32_t(o.width), std::uint32_t(o.height)),
        terrain(card, store, target.pass(), supply.most_tiles()),
        effects(card, db, scene_of(o)),
        commands(card),
        timer(card, 4),
        counter(make_counter()),
        ground(ground_of(db)) {
    if (db.grids().empty()) throw Error(db.path(), "it holds no grid to draw");
  }

  vk::OwnedQueries make_counter() const {
    if (!card.features.pipelineStatisticsQuery) return {};
    VkQueryPoolCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
    info.queryType = VK_QUERY_TYPE_PIPELINE_STATISTICS, info.queryCount = 1;
    info.pipelineStatistics = VK_QUERY_PIPELINE_STATISTIC_CLIPPING_INVOCATIONS_BIT;
    VkQueryPool pool = VK_NULL_HANDLE;
    card.check(vkCreateQueryPool(card.get(), &info, nullptr, &pool), "counting triangles");
    return vk::OwnedQueries(card.get(), pool);
  }

  vk::FrameBlock make_block(const Frustum& frustum, double curvature) const {
    vk::FrameBlock b{};
    put_matrix(projection(camera, kNear) * glm::dmat4(view_rotation(camera)), b.clip);
    for (int s = 0; s < 4; ++s)
      for (int k = 0; k < 3; ++k) b.sides[s][k] = float(frustum.sides()[std::size_t(s)][std::size_t(k)]);
    for (int k = 0; k < 3; ++k) b.axis[k] = float(frustum.axis()[std::size_t(k)]);
    b.axis[3] = float(kNear);
    const CameraAxes a = axes(camera);
    const double high = camera.tan_half(), wide = high * camera.width / camera.height;
    for (int k = 0; k < 3; ++k) b.right[k] = float(wide * a.right[k]), b.up[k] = float(high * a.up[k]);
    b.right[3] = float(2.0 / camera.width), b.up[3] = float(2.0 / camera.height);
    const auto cell = half_cell_at(lattice, {camera.eye.x, camera.eye.y});
    b.eye[0] = float(camera.eye.x - (lattice.origin().x + cell[0] * lattice.half_cell()));
    b.eye[1] = float(camera.eye.y - (lattice.origin().y + cell[1] * lattice.half_cell()));
    b.eye[2] = float(base - camera.eye.z), b.eye[3] = float(lattice.half_cell());
    b.detail[0] = float(camera.gamma() / options.pixel_error), b.detail[1] = float(curvature);
    b.detail[3] = options.tessellation == Tessellation::published;
    return b;
  }

  // From an eye above terrain without gaps, what a line of sight meets first looks towards the eye. Coarse
  // tiles may have teeth along the outline, and those in sight that are stale gaps towards others.
  bool hides_what_looks_away(const Selection& selection, const FrameStats& stats) const {
    if (stats.tiles_coarse > 0 || selection.stale || std::isfinite(options.far)) return false;
    if (!ground || !ground->holds({camera.eye.x, camera.eye.y})) return false;
    const double tile = 2 * TileLattice::kCells * lattice.half_cell();
    const TileKey key{0, std::int32_t(std::floor((camera.eye.x - lattice.origin().x) / tile)),
                      std::int32_t(std::floor((camera.eye.y - lattice.origin().y) / tile))};
    const Selection::Leaf* leaf = lattice.contains(key) ? selection.leaf_at(key, 0, 0) : nullptr;
    const TileCache::Node* node = leaf ? supply.cache().find(leaf->key) : nullptr;
    const double high = camera.tan_half(),
                 corner = kNear * std::hypot(1, high, high * camera.width / camera.height);
    if (!node || node->empty) return false;
    const double changed = node->stale ? supply.heights().highest : -INFINITY;
    return camera.eye.z > std::max(node->facts.highest + node->facts.error, changed) + corner;
  }

  void submit(FrameStats& stats) {
    const VkCommandBuffer c = commands.begin();
    timer.reset(c);
    timer.mark(c);
    if (counter) vkCmdResetQueryPool(c, counter.get(), 0, 1);
    const std::size_t shadows = effects.shadow_dispatches(), skies = effects.sky_dispatches();
    const std::size_t texels = effects.light_texels();
    effects.record_maps(c, light_budget(options));
    stats.light_texels = effects.light_texels() - texels;
    stats.shadow_dispatches = effects.shadow_dispatches() - shadows;
    stats.sky_dispatches = effects.sky_dispatches() - skies;
    terrain.use(effects, stats.front_only);
    timer.mark(c);
    stats.dispatches += terrain.record_subdivision(c) + stats.shadow_dispatches + stats.sky_dispatches;
    timer.mark(c);
    const float background[4] = {float(options.background.r) / 255, float(options.background.g) / 255,
                                 float(options.background.b) / 255, 1};
    if (counter) vkCmdBeginQuery(c, counter.get(), 0, 0);
    target.begin(c, background);
    terrain.record_draws(c);
    target.end(c);
    if (counter) vkCmdEndQuery(c, counter.get(), 0);
    timer.mark(c);
    commands.submit(), commands.wait();
    const std::vector<double> ms = timer.intervals();
    stats.light_ms = ms[0], stats.factors_ms = ms[1], stats.draw_ms = ms[2];
    stats.draws = terrain.subdivision().draws();
    if (counter)
      card.check(vkGetQueryPoolResults(card.get(), counter.get(), 0, 1, 8, &stats.triangles, 8,
                                       VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
                 "counting triangles");
  }

  void read_back(bool color, bool depth) {
    target.read_back(commands.begin(), color, depth);
    commands.submit(), commands.wait();
  }

  // Of all terrain, seen or not: gates that hold for it hold for what is seen.
  effects::SceneView scene_view() const {
    const ViewCut all = over_terrain_of(db, {.eye = camera.eye, .look = camera.look});
    return {camera, all.lowest, all.highest, all.far};
  }

  // Vertices of a tile's border come from its neighbours: they lie within its error.
  std::uint32_t matter_to(const TileKey& key, const TileFacts& facts) const {
    if (!effects.gates_tiles()) return std::uint32_t(effects.on().to_ulong());
    const Extent e = lattice.bounds(key);
    effects::TileView tile{facts.lowest - facts.error, facts.highest + facts.error};
    tile.farthest = std::hypot(std::max(camera.eye.x - e.xmin, e.xmax - camera.eye.x),
                               std::max(camera.eye.y - e.ymin, e.ymax - camera.eye.y),
                               std::max(camera.eye.z - tile.lowest, tile.highest - camera.eye.z));
    tile.lowest_air = std::min(tile.lowest, camera.eye.z);
    return std::uint32_t(effects.matter_to(tile).to_ulong());
  }

  FrameStats draw(const Camera& from);
};

FrameStats Renderer::Impl::draw(const Camera& from) {
  const Stopwatch watch;
  FrameStats stats;
  stats.pixels_asked = options.pixel_error, stats.workers_held = holding;
  camera = from, camera.width = options.width, camera.height = options.height;
  const effects::SceneView view = scene_view();
  const double curvature = effects.curvature(view);
  const Frustum frustum(camera, curvature, options.far);
  const Selection& selection = supply.update(frustum, stats);
  const vk::FrameBlock now = make_block(frustum, curvature);
  std::vector<float> bounds;
  for (const std::uint32_t k : selection.drawn)
    bounds.push_back(float(supply.cache().find(selection.leaves[k].key)->facts.bound));
  for (const float b : bounds) stats.bound_max = std::max(stats.bound_max, double(b));
  const bool other_look = effects.prepare(view, bounds, light_budget(options));
  make_draws(lattice, selection, supply.cache(), {camera.eye.x, camera.eye.y}, draws,
             [&](const TileKey& key, const TileFacts& facts) { return matter_to(key, facts); });
  stats.tiles_drawn = draws.size();
  stats.front_only = hides_what_looks_away(selection, stats);
  // With the same input the picture is the one that is there.
  if (!drawn || other_look || stats.tiles_made > 0 || now != block || draws != last_draws) {
    terrain.set(now, draws);
    stats.bytes_up += terrain.bytes_set() + effects.bytes_set();
    block = now, last_draws = draws, drawn = stats.redrawn = true;
    submit(stats);
  }
  stats.light_left = effects.light_left();
  stats.total_ms = watch.milliseconds();
  return stats;
}

Renderer::Renderer(std::shared_ptr<Device> device, const Database& db, const RendererOptions& options)
    : impl_(std::make_unique<Impl>(std::move(device), db, options)) {}
Renderer::~Renderer() = default;

FrameStats Renderer::draw(const Camera& camera) { return impl_->draw(camera); }

Image Renderer::picture() const {
  impl_->read_back(true, false);
  Image image(impl_->options.width, impl_->options.height, {});
  const std::uint32_t* from = impl_->target.pixels();
  for (std::size_t k = 0; k < image.pixels.size(); ++k)
    image.pixels[k] = {std::uint8_t(from[k]), std::uint8_t(from[k] >> 8), std::uint8_t(from[k] >> 16)};
  draw_legend(image);
  return image;
}

ValueScale Renderer::overlay_scale() const { return impl_->effects.scale(); }
void Renderer::keep_scale() { impl_->effects.keep_scale(); }
void Renderer::draw_legend(Image& picture) const { impl_->effects.draw_legend(picture); }

void Renderer::change(const SceneEffects& to) {
  if (knowing(to) && !impl_->store.holds.knowledge)
    throw Error("effects", "this renderer was made without overlays of bounds and sources");
  impl_->options.effects = to;
  impl_->effects.change(scene_of(impl_->options));
}

std::vector<float> Renderer::depth() const {
  impl_->read_back(false, true);
  return impl_->target.metres(impl_->camera, kNear);
}

bool Renderer::refresh(Database& db) {
  if (!impl_->holding && db.is_newest()) return false;
  impl_->holding = !impl_->supply.hold();
  if (impl_->holding) return false;
  const std::uint64_t before = db.version();
  const bool moved = db.refresh();
  std::vector<Extent> changed;
  bool another_lattice = false;
  if (moved) {
    for (const Change& c : db.changed_since(before)) changed.push_back(c.extent);
    const bool nothing = db.grids().empty();
    another_lattice = nothing || !impl_->lattice.fits(db);
    if (another_lattice && !nothing) impl_->lattice = TileLattice::over(db);
    impl_->ground = ground_of(db);
  }
  impl_->supply.release(moved, changed, another_lattice);
  if (moved) impl_->effects.heights_changed(changed);
  return moved;
}

Renderer::Drawn Renderer::drawn() const { return {impl_->store, impl_->block, impl_->draws}; }
Tessellation Renderer::tessellation() const { return *impl_->options.tessellation; }
std::vector<MeshVertex> Renderer::mesh() const {
  return impl_->terrain.subdivision().read_mesh(impl_->commands);
}

void Renderer::reshape(int width, int height, double pixel_error) {
  RendererOptions& o = impl_->options;
  o.pixel_error = pixel_error;
  impl_->supply.set_pixel_error(pixel_error);
  if (o.width == width && o.height == height) return;
  o.width = width, o.height = height, impl_->drawn = false;
  impl_->effects.change(scene_of(o));
  impl_->target.resize(impl_->card, std::uint32_t(width), std::uint32_t(height));
}

const TileCache& Renderer::cache() const { return impl_->supply.cache(); }
const TileLattice& Renderer::lattice() const { return impl_->lattice; }
std::vector<TileKey> Renderer::tiles() const {
  std::vector<TileKey> keys;
  for (const std::uint32_t k : impl_->supply.selection().drawn)
    keys.push_back(impl_->supply.selection().leaves[k].key);
  return keys;
}
const vk::Target& Renderer::target() const { return impl_->target; }

}  // namespace patchwork
