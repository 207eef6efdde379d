#include "render/renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

#include "db/error.h"
#include "render/tile_seams.h"
#include "render/tile_selection.h"
#include "render/vulkan/terrain_pass_impl.h"
#include "render/vulkan/tile_maker.h"

namespace patchwork {

namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// The middle of all heights, where float32 loses least.
double middle_height(const Database& db) {
  double lowest = INFINITY, highest = -INFINITY;
  for (const Grid& g : db.grids())
    lowest = std::min(lowest, g.info.lowest), highest = std::max(highest, g.info.highest);
  return lowest <= highest ? std::nearbyint(0.5 * (lowest + highest)) : 0;
}

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

}  // namespace

struct Renderer::Impl {
  std::shared_ptr<Device> device;
  const Database& db;
  RendererOptions options;
  const Device::Impl& card;
  TileLattice lattice;
  double base;
  vk::TileStore store;
  TileCache cache;
  vk::Target target;
  std::uint32_t most_tiles;
  vk::TerrainPass terrain;
  TileMaker maker;
  vk::Commands commands;
  vk::Timer timer;
  vk::OwnedQueries counter;
  Selection selection;
  std::vector<TileDraw> draws, last_draws;
  vk::FrameBlock block{};
  Camera camera;
  bool drawn = false;

  Impl(std::shared_ptr<Device> d, const Database& database, const RendererOptions& o)
      : device(std::move(d)),
        db(database),
        options(o),
        card(drawing(*device)),
        lattice(TileLattice::over(db)),
        base(middle_height(db)),
        store(card, vk::TileStore::slots_within(card, o.memory / 2)),
        cache(store.slots, o.policy),
        target(card, std::uint32_t(o.width), std::uint32_t(o.height)),
        most_tiles(store.slots * 2 / 3),
        terrain(card, store, target.pass(), most_tiles),
        maker(device, db, lattice, store, base, o.smoothness, o.memory / 2),
        commands(card),
        timer(card, 3),
        counter(make_counter()) {
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

  void select(const Frustum& frustum, FrameStats& stats) {
    const auto start = Clock::now();
    select_tiles(lattice, frustum, {options.pixel_error, most_tiles}, cache, selection);
    stats.select_ms += ms_since(start);
  }

  // Makes what the selection wants, level by level; false if nothing could be made.
  bool make_wanted() {
    std::vector<TileKey> keys;
    for (const Selection::Wanted& w : selection.wanted) keys.push_back(w.key);
    std::stable_sort(keys.begin(), keys.end(),
                     [](const TileKey& a, const TileKey& b) { return a.level > b.level; });
    std::size_t made = 0;
    for (std::size_t from = 0; from < keys.size();) {
      std::size_t to = from;
      while (to < keys.size() && keys[to].level == keys[from].level) ++to;
      const auto some = std::span(keys).subspan(from, to - from);
      for (const TileMaker::Made& m : maker.make(some, [&] { return cache.take_slot(); }))
        cache.put(m.key, m.facts, m.slot), ++made;
      from = to;
    }
    return made > 0;
  }

  vk::FrameBlock make_block(const Frustum& frustum) const {
    vk::FrameBlock b{};
    put_matrix(projection(camera, kNear) * glm::dmat4(view_rotation(camera)), b.clip);
    for (int s = 0; s < 4; ++s)
      for (int k = 0; k < 3; ++k) b.sides[s][k] = float(frustum.sides()[std::size_t(s)][std::size_t(k)]);
    for (int k = 0; k < 3; ++k) b.axis[k] = float(frustum.axis()[std::size_t(k)]);
    b.axis[3] = float(kNear);
    const auto cell = half_cell_at(lattice, {camera.eye.x, camera.eye.y});
    b.eye[0] = float(camera.eye.x - (lattice.origin().x + cell[0] * lattice.half_cell()));
    b.eye[1] = float(camera.eye.y - (lattice.origin().y + cell[1] * lattice.half_cell()));
    b.eye[2] = float(base - camera.eye.z), b.eye[3] = float(lattice.half_cell());
    b.detail[0] = float(frustum.gamma() / options.pixel_error), b.detail[1] = float(options.curvature);
    b.detail[2] = float(frustum.gamma()), b.detail[3] = options.published;
    return b;
  }

  void submit(FrameStats& stats) {
    const VkCommandBuffer c = commands.begin();
    timer.reset(c);
    timer.mark(c);
    if (counter) vkCmdResetQueryPool(c, counter.get(), 0, 1);
    terrain.record_factors(c);
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
    stats.factors_ms = ms[0], stats.draw_ms = ms[1];
    stats.dispatches += terrain.draws() > 0, stats.draws = terrain.draws();
    if (counter)
      card.check(vkGetQueryPoolResults(card.get(), counter.get(), 0, 1, 8, &stats.triangles, 8,
                                       VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
                 "counting triangles");
  }

  void read_back(bool color, bool depth) {
    target.read_back(commands.begin(), color, depth);
    commands.submit(), commands.wait();
  }

  FrameStats draw(const Camera& from);
  void note_made(const TileMakerCounts& before, FrameStats& stats) const;
};

void Renderer::Impl::note_made(const TileMakerCounts& before, FrameStats& stats) const {
  const TileMakerCounts& after = maker.counts();
  stats.tiles_made = after.tiles - before.tiles, stats.patches_sent = after.patches - before.patches;
  stats.bytes_up = after.bytes - before.bytes;
  stats.extract_ms = after.extract_ms - before.extract_ms, stats.send_ms = after.send_ms - before.send_ms;
  stats.blend_ms = after.blend_ms - before.blend_ms, stats.finish_ms = after.finish_ms - before.finish_ms;
  stats.blended = after.blended;
  stats.blended.points -= before.blended.points;
  stats.blended.contributions -= before.blended.contributions;
}

FrameStats Renderer::Impl::draw(const Camera& from) {
  const auto start = Clock::now();
  FrameStats stats;
  stats.pixels_asked = options.pixel_error;
  camera = from, camera.width = options.width, camera.height = options.height;
  const Frustum frustum(camera, options.curvature);
  const TileMakerCounts before = maker.counts();
  cache.begin_frame();
  do select(frustum, stats);
  while (!selection.wanted.empty() && make_wanted());
  make_draws(lattice, selection, cache, {camera.eye.x, camera.eye.y}, draws);
  const vk::FrameBlock now = make_block(frustum);
  note_made(before, stats);
  stats.tiles_drawn = draws.size(), stats.tiles_wanted = selection.wanted.size();
  stats.pixels_reached = selection.pixels;
  for (const std::uint32_t k : selection.drawn)
    stats.bound_max = std::max(stats.bound_max, cache.find(selection.leaves[k].key)->facts.bound);
  // With the same input the picture is the one that is there.
  if (!drawn || stats.tiles_made > 0 || now != block || draws != last_draws) {
    terrain.set(now, draws);
    stats.bytes_up += terrain.bytes_set();
    block = now, last_draws = draws, drawn = true;
    submit(stats);
  }
  stats.total_ms = ms_since(start);
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
  return image;
}

std::vector<float> Renderer::depth() const {
  impl_->read_back(false, true);
  const Camera& c = impl_->camera;
  std::vector<float> metres(std::size_t(c.width) * std::size_t(c.height));
  const float* from = impl_->target.depths();
  for (int y = 0; y < c.height; ++y)
    for (int x = 0; x < c.width; ++x) {
      const std::size_t k = std::size_t(y) * std::size_t(c.width) + std::size_t(x);
      metres[k] = from[k] > 0
                      ? float(axial_of_depth(double(from[k]), kNear) / axial_share(c, x + 0.5, y + 0.5))
                      : NAN;
    }
  return metres;
}

void Renderer::restate(const std::vector<Extent>& changed) {
  for (const Extent& e : changed) impl_->cache.invalidate(impl_->lattice, e);
  impl_->maker.restart();
}

const TileCache& Renderer::cache() const { return impl_->cache; }
const TileLattice& Renderer::lattice() const { return impl_->lattice; }

}  // namespace patchwork
