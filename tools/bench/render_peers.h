// The same view drawn in other ways: the whole grid as one mesh, tiles without tessellation, bare shading.
#pragma once

#include <memory>
#include <vector>

#include "render/renderer.h"

namespace patchwork::cli {

/// Each draws one frame and returns its milliseconds on the card. Throws Error: no memory.
class RenderPeers {
 public:
  /// `grid` of `db` is the mesh; none where it is null.
  RenderPeers(std::shared_ptr<Device> device, const Database& db, const Grid* grid, int width, int height);
  ~RenderPeers();

  double full_mesh(const Camera& camera);
  /// The tiles that `renderer` drew last, each as 64 x 64 cells; as chunks are drawn, but for their skirts.
  /// Stitched: without cracks between chunks, to see how far off they are; with more work a vertex.
  double chunked(const Renderer& renderer);
  double stitched(const Renderer& renderer);
  /// A full-screen triangle with the same shading.
  double full_screen(const Renderer& renderer);
  /// So many indexed triangles without shading: of those tiles, the same share of each; and all over the
  /// picture, where each is seen.
  double plain(const Renderer& renderer, std::size_t triangles);
  double covering(std::size_t triangles);
  /// Of what was drawn last: as Renderer::depth().
  std::vector<float> depth(const Camera& camera);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork::cli
