#include "tools/bench/render_peers.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "query/extract.h"
#include "render/tile_seams.h"
#include "render/vulkan/graphics_impl.h"
#include "render/vulkan/terrain_pass_impl.h"

namespace patchwork::cli {

namespace {

// Made by glslc in the build tree (tools/CMakeLists.txt).
constexpr std::uint32_t kMeshVert[] = {
#include "peer_mesh.vert.inc"
};
constexpr std::uint32_t kMeshFrag[] = {
#include "peer_mesh.frag.inc"
};
constexpr std::uint32_t kPlainVert[] = {
#include "peer_plain.vert.inc"
};
constexpr std::uint32_t kPlainFrag[] = {
#include "peer_plain.frag.inc"
};
constexpr std::uint32_t kChunkVert[] = {
#include "peer_chunk.vert.inc"
};
constexpr std::uint32_t kScreenVert[] = {
#include "peer_screen.vert.inc"
};
constexpr std::uint32_t kSlopesFrag[] = {
#include "peer_slopes.frag.inc"
};

constexpr VkDescriptorType kUniform = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
constexpr VkDescriptorType kTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
constexpr VkDescriptorType kImage = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
constexpr VkShaderStageFlags kStages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
constexpr VkBufferUsageFlags kTexelBuffer = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;

struct MeshBlock {
  float clip[16], from[4], steps[4];
};

// Two triangles a cell, row by row.
std::vector<std::uint32_t> grid_indices(int columns, int rows) {
  std::vector<std::uint32_t> all;
  all.reserve(std::size_t(columns - 1) * std::size_t(rows - 1) * 6);
  for (int r = 0; r + 1 < rows; ++r)
    for (int c = 0; c + 1 < columns; ++c) {
      const std::uint32_t a = std::uint32_t(r * columns + c), b = a + std::uint32_t(columns);
      for (const std::uint32_t v : {a, a + 1, b + 1, a, b + 1, b}) all.push_back(v);
    }
  return all;
}

vk::OwnedPipeline triangles(const vk::Bindings& bindings, VkRenderPass pass,
                            std::span<const std::uint32_t> vert, std::span<const std::uint32_t> frag,
                            std::span<const std::uint32_t> constants = {}) {
  return vk::make_graphics(
      bindings, pass,
      {.stages = {{VK_SHADER_STAGE_VERTEX_BIT, vert}, {VK_SHADER_STAGE_FRAGMENT_BIT, frag}},
       .constants = constants,
       .topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST});
}

// A grid as one mesh on the card.
struct Mesh {
  const Frame& frame;
  int columns, rows;
  vk::Buffer block, vertices, indices;
  vk::OwnedView texels;
  std::size_t triangles;

  Mesh(const Device::Impl& card, const Database& db, const Grid& grid)
      : frame(grid.info.frame),
        columns(grid.info.shape.width()),
        rows(grid.info.shape.height()),
        block(card, sizeof(MeshBlock), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, vk::Where::upload),
        vertices(card, std::size_t(columns) * std::size_t(rows) * 16, kTexelBuffer, vk::Where::upload),
        indices(card, std::size_t(columns - 1) * std::size_t(rows - 1) * 24, VK_BUFFER_USAGE_INDEX_BUFFER_BIT,
                vk::Where::upload),
        texels(vk::texels(card, vertices, VK_FORMAT_R32G32B32A32_SFLOAT)) {
    const std::vector<std::uint32_t> all = grid_indices(columns, rows);
    std::memcpy(indices.mapped(), all.data(), all.size() * 4);
    triangles = all.size() / 3;
    fill(db);
  }

  void fill(const Database& db) {
    const auto& n = frame.numbers();
    std::vector<double> h(std::size_t(columns) * std::size_t(rows));
    const Extraction x = extract(db, {.error = 0});
    Blend(db, x.patches, {})
        .at_pixels({n[0], n[1], n[2], n[3], n[4], n[5]}, columns, 0, rows, {h, {}, {}, {}});
    const auto at = [&](int c, int r) {
      c = std::clamp(c, 0, columns - 1), r = std::clamp(r, 0, rows - 1);
      const double v = h[std::size_t(r) * std::size_t(columns) + std::size_t(c)];
      return std::isnan(v) ? 0 : v;
    };
    auto* to = reinterpret_cast<float*>(vertices.mapped());
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c, to += 4) {
        const double di = (at(c + 1, r) - at(c - 1, r)) / 2, dj = (at(c, r + 1) - at(c, r - 1)) / 2;
        const auto& v = frame.inverse();
        to[0] = float(at(c, r));
        to[1] = float(v[0] * di + v[2] * dj), to[2] = float(v[1] * di + v[3] * dj), to[3] = 0;
      }
  }

  void place(const Camera& camera) const {
    MeshBlock b{};
    const glm::dmat4 clip = projection(camera, Renderer::kNear) * glm::dmat4(view_rotation(camera));
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 4; ++r) b.clip[4 * c + r] = float(clip[c][r]);
    const auto& n = frame.numbers();
    b.from[0] = float(n[0] - camera.eye.x), b.from[1] = float(n[3] - camera.eye.y);
    b.from[2] = float(-camera.eye.z), b.from[3] = float(columns);
    b.steps[0] = float(n[1]), b.steps[1] = float(n[4]), b.steps[2] = float(n[2]), b.steps[3] = float(n[5]);
    std::memcpy(block.mapped(), &b, sizeof b);
  }
};

}  // namespace

struct RenderPeers::Impl {
  std::shared_ptr<Device> device;
  const Device::Impl& card;
  vk::Target target;
  vk::Bindings mesh_bindings, tile_bindings;
  vk::OwnedPipeline mesh_pipeline, plain_pipeline, chunk_pipeline, stitched_pipeline, screen_pipeline;
  VkDescriptorSet mesh_set = VK_NULL_HANDLE, plain_set = VK_NULL_HANDLE, tile_set = VK_NULL_HANDLE;
  vk::OwnedSets mesh_sets, plain_sets, tile_sets;
  vk::Buffer frame, plain_block, plain_indices, draws, chunk_indices;
  vk::OwnedView draw_texels;
  std::uint32_t chunk_index_count = 0;
  std::unique_ptr<Mesh> mesh;
  vk::Commands commands;
  vk::Timer timer;

  static constexpr VkDescriptorType kMeshTypes[] = {kUniform, kTexels};
  static constexpr VkDescriptorType kTileTypes[] = {kUniform, kTexels, kTexels, kImage};
  static constexpr std::size_t kMostDraws = 4096;
  static constexpr std::uint32_t kStitched[] = {1};

  Impl(std::shared_ptr<Device> d, const Database& db, const Grid* grid, int width, int height)
      : device(std::move(d)),
        card(device->impl()),
        target(card, std::uint32_t(width), std::uint32_t(height)),
        mesh_bindings(card, kMeshTypes, 0, kStages),
        tile_bindings(card, kTileTypes, 0, kStages),
        mesh_pipeline(triangles(mesh_bindings, target.pass(), kMeshVert, kMeshFrag)),
        plain_pipeline(triangles(mesh_bindings, target.pass(), kPlainVert, kPlainFrag)),
        chunk_pipeline(triangles(tile_bindings, target.pass(), kChunkVert, kSlopesFrag)),
        stitched_pipeline(triangles(tile_bindings, target.pass(), kChunkVert, kSlopesFrag, kStitched)),
        screen_pipeline(triangles(tile_bindings, target.pass(), kScreenVert, kSlopesFrag)),
        mesh_sets(mesh_bindings.make_set(mesh_set)),
        plain_sets(mesh_bindings.make_set(plain_set)),
        tile_sets(tile_bindings.make_set(tile_set)),
        frame(card, sizeof(vk::FrameBlock), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, vk::Where::upload),
        plain_block(card, sizeof(MeshBlock), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, vk::Where::upload),
        draws(card, kMostDraws * sizeof(TileDraw), kTexelBuffer, vk::Where::upload),
        draw_texels(vk::texels(card, draws, VK_FORMAT_R32G32B32A32_UINT)),
        commands(card),
        timer(card, 2) {
    const std::vector<std::uint32_t> all = grid_indices(TileLattice::kVertices, TileLattice::kVertices);
    chunk_index_count = std::uint32_t(all.size());
    chunk_indices = vk::Buffer(card, all.size() * 4, VK_BUFFER_USAGE_INDEX_BUFFER_BIT, vk::Where::upload);
    std::memcpy(chunk_indices.mapped(), all.data(), all.size() * 4);
    mesh_bindings.bind(plain_set, 0, plain_block);
    if (!grid) return;
    mesh = std::make_unique<Mesh>(card, db, *grid);
    mesh_bindings.bind(mesh_set, 0, mesh->block), mesh_bindings.bind(mesh_set, 1, mesh->texels);
  }

  // Clears, draws, waits.
  template <class Draw>
  double measure(const vk::Bindings& bindings, VkDescriptorSet set, VkPipeline pipeline, Draw draw) {
    const VkCommandBuffer c = commands.begin();
    timer.reset(c);
    timer.mark(c);
    target.begin(c, {0, 0, 0, 1});
    vkCmdBindDescriptorSets(c, VK_PIPELINE_BIND_POINT_GRAPHICS, bindings.layout(), 0, 1, &set, 0, nullptr);
    vkCmdBindPipeline(c, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline);
    draw(c);
    target.end(c);
    timer.mark(c);
    commands.submit(), commands.wait();
    return timer.intervals()[0];
  }

  std::size_t take(const Renderer& renderer) {
    const Renderer::Drawn d = renderer.drawn();
    tile_bindings.bind(tile_set, 0, frame), tile_bindings.bind(tile_set, 1, draw_texels);
    tile_bindings.bind(tile_set, 2, d.store.height_texels);
    tile_bindings.bind(tile_set, 3, d.store.sampler.get(), d.store.slopes.view(), VK_IMAGE_LAYOUT_GENERAL);
    std::memcpy(frame.mapped(), &d.frame, sizeof d.frame);
    const std::size_t n = std::min(d.draws.size(), kMostDraws);
    if (n > 0) std::memcpy(draws.mapped(), d.draws.data(), n * sizeof(TileDraw));
    return n;
  }

  double draw_chunks(const Renderer& renderer, VkPipeline pipeline, std::size_t triangles) {
    const std::size_t n = take(renderer), all = n * chunk_index_count / 3;
    const auto indices = std::uint32_t(triangles >= all ? chunk_index_count : 3 * (triangles / n));
    return measure(tile_bindings, tile_set, pipeline, [&](VkCommandBuffer c) {
      vkCmdBindIndexBuffer(c, chunk_indices.get(), 0, VK_INDEX_TYPE_UINT32);
      for (std::uint32_t d = 0; d < n; ++d) vkCmdDrawIndexed(c, indices, 1, 0, 0, d);
    });
  }
};

RenderPeers::RenderPeers(std::shared_ptr<Device> device, const Database& db, const Grid* grid, int width,
                         int height)
    : impl_(std::make_unique<Impl>(std::move(device), db, grid, width, height)) {}
RenderPeers::~RenderPeers() = default;

double RenderPeers::full_mesh(const Camera& camera) {
  impl_->mesh->place(camera);
  return impl_->measure(impl_->mesh_bindings, impl_->mesh_set, impl_->mesh_pipeline.get(),
                        [&](VkCommandBuffer c) {
                          vkCmdBindIndexBuffer(c, impl_->mesh->indices.get(), 0, VK_INDEX_TYPE_UINT32);
                          vkCmdDrawIndexed(c, std::uint32_t(3 * impl_->mesh->triangles), 1, 0, 0, 0);
                        });
}

double RenderPeers::plain(const Renderer& renderer, std::size_t n) {
  return impl_->draw_chunks(renderer, impl_->chunk_pipeline.get(), n);
}
double RenderPeers::chunked(const Renderer& renderer) { return plain(renderer, SIZE_MAX); }
double RenderPeers::stitched(const Renderer& renderer) {
  return impl_->draw_chunks(renderer, impl_->stitched_pipeline.get(), SIZE_MAX);
}

// Cells as square as their number allows.
double RenderPeers::covering(std::size_t n) {
  Impl& p = *impl_;
  const VkExtent2D size = p.target.size();
  const double cells = double(std::max<std::size_t>(n, 2)) / 2;
  const int columns = std::max(1, int(std::sqrt(cells * size.width / size.height)));
  const int rows = std::max(1, int(cells / columns));
  const std::vector<std::uint32_t> all = grid_indices(columns + 1, rows + 1);
  if (p.plain_indices.bytes() < 4 * all.size())
    p.plain_indices = vk::Buffer(p.card, 4 * all.size(), VK_BUFFER_USAGE_INDEX_BUFFER_BIT, vk::Where::upload);
  std::memcpy(p.plain_indices.mapped(), all.data(), 4 * all.size());
  const MeshBlock block{.clip = {},
                        .from = {-1, -1, 0, float(columns + 1)},
                        .steps = {2 / float(columns), 0, 0, 2 / float(rows)}};
  std::memcpy(p.plain_block.mapped(), &block, sizeof block);
  return p.measure(p.mesh_bindings, p.plain_set, p.plain_pipeline.get(), [&](VkCommandBuffer c) {
    vkCmdBindIndexBuffer(c, p.plain_indices.get(), 0, VK_INDEX_TYPE_UINT32);
    vkCmdDrawIndexed(c, std::uint32_t(all.size()), 1, 0, 0, 0);
  });
}

std::vector<float> RenderPeers::depth(const Camera& camera) {
  Impl& p = *impl_;
  p.target.read_back(p.commands.begin(), false, true);
  p.commands.submit(), p.commands.wait();
  return p.target.metres(camera, Renderer::kNear);
}

double RenderPeers::full_screen(const Renderer& renderer) {
  impl_->take(renderer);
  return impl_->measure(impl_->tile_bindings, impl_->tile_set, impl_->screen_pipeline.get(),
                        [](VkCommandBuffer c) { vkCmdDraw(c, 3, 1, 0, 0); });
}

}  // namespace patchwork::cli
