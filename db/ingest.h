// One grid on its way into the database: read twice in row bands, as integer codes with holes filled.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "db/buffer.h"
#include "db/cell_masks.h"
#include "db/grid.h"
#include "db/lattice.h"
#include "db/raster.h"

namespace patchwork {

/// Raw sample r is stored as the integer nearest to r / quantum - origin.
struct Quantiser {
  double quantum = 1;  ///< raw units per code
  std::int64_t origin = 0;
  double error = 0;  ///< largest distance between a sample and its stored form, raw units
};

/// Called with the share of the work done, 0 to 1.
using Progress = std::function<void(double)>;

class Ingest {
 public:
  /// Levels below this one are made band by band, the others are kept whole (1/48 of the samples).
  static constexpr int kStreamedLevels = 3;

  /// Reads the source once: range, quantum, holes, coarse levels. Memory: `memory` bytes hold the raw samples
  /// if they fit in a quarter of it, else the source is read again in bands. Throws Error: all nodata, and
  /// what reading throws. `tolerance`: metres by which a stored sample may differ from the source's.
  Ingest(const RasterSource& source, std::size_t memory, double tolerance = 0, const Progress& progress = {});

  const GridShape& shape() const { return shape_; }
  const Quantiser& quantiser() const { return quantiser_; }
  double lowest() const { return low_; }  ///< raw
  double highest() const { return high_; }
  const CellMasks& masks() const { return masks_; }
  const Lattice& coarse(int level) const { return coarse_[size_t(level - kStreamedLevels)]; }

  /// Rows [y0, y1) of the grid with what the levels below kStreamedLevels need around them.
  struct Band {
    int y0, y1;
    std::vector<Lattice> levels;      ///< 0, 1, 2 (as many as the grid has)
    std::vector<std::uint8_t> valid;  ///< of level 0's rows, width each; empty where the grid has no holes
  };
  /// The coarse levels and what they were made of are no longer asked for.
  void drop_coarse() { std::vector<Lattice>().swap(coarse_), kept_ = Buffer<float>(); }
  /// Rows of a band: a multiple of a payload chunk of the coarsest streamed level.
  int band_rows() const { return band_rows_; }
  Band read_band(int y0, int y1) const;

 private:
  template <class Raw>
  struct OctetScan;
  void scan(const Progress& progress);
  template <class Raw, class Visit>
  void read_strips(int first, int end, Visit visit) const;
  template <class Raw>
  void scan_rows(int y, int rows, const Raw* raw);
  void note_cells(int y, int rows, const std::vector<std::uint8_t>& valid);
  void choose_quantiser(double tolerance);
  void fill_means();
  void make_coarse();
  double knot(int i, int j) const;
  double code_of(double raw) const;
  void fill_holes(Lattice& codes, std::span<const std::uint8_t> valid) const;

  const RasterSource& source_;
  GridShape shape_;
  int band_rows_ = 0;
  Buffer<float> kept_;  // raw samples, where they fit
  Quantiser quantiser_;
  double low_ = 0, high_ = 0;
  int finest_bit_ = 1 << 20;                          // exponent of the finest bit set in any raw sample
  std::vector<std::uint8_t> cells_, last_row_valid_;  // level-0 cells so far, once a hole was met
  CellMasks masks_;
  std::vector<double> means_;  // of 8 x 8 samples, raw; NaN where none is valid, until filled
  int means_cols_ = 0, means_rows_ = 0;
  std::vector<int> knot_rows_, knot_cols_;  // rows and columns that the coarse levels are made of, sorted
  std::vector<double> knots_;               // raw samples there
  std::vector<Lattice> coarse_;
};

}  // namespace patchwork
