// One page of the R-tree: up to 64 boxes in a structure of arrays, compared in vectors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "db/float_rounding.h"
#include "db/frame.h"
#include "db/patch_id.h"

namespace patchwork {

/// An upright box of LOD space: bounds of the footprint times the error interval [bottom, top), metres.
struct LodBox {
  double xmin, ymin, xmax, ymax;
  float bottom, top;
  bool operator==(const LodBox&) const = default;
  /// Finite sides, each minimum at most its maximum, 0 <= bottom <= top; top may be infinite.
  bool sound() const;
};

/// A box and whose it is.
struct LodEntry {
  LodBox box;
  PatchId id;
  bool operator==(const LodEntry&) const = default;
};

/// The smallest box around both.
LodBox united(const LodBox& a, const LodBox& b);
bool contains(const LodBox& outer, const LodBox& inner);
/// An error (metres, 0 to infinity) on a scale of octaves, in which one step counts the same anywhere:
/// piecewise linear between powers of two, finite at both ends.
float error_octaves(float error);

/// What a cut makes of a page: bit s is set in `met` if box s can belong to the answer, in `inside` if it
/// lies in the region as a whole, so that what is below it need not be asked where it lies; of a leaf, which
/// has nothing below it, `inside` says nothing.
struct LodHits {
  std::uint64_t met = 0, inside = 0;
};

/// Slots [0, count) are in use. In a leaf (level 0) an entry's id is a patch, elsewhere the index of a page.
struct LodPage {
  static constexpr std::size_t kLine = 64;        ///< bytes that memory gives at once
  static constexpr std::uint32_t kSlots = 64;     ///< a visit keeps its hits in one 64-bit mask
  static constexpr std::uint32_t kMinSlots = 24;  ///< of every page but the root
  static constexpr std::uint32_t kFree = 0xffff;  ///< the level of a page that is not in use

  std::uint32_t level, count = 0;
  /// A place near the boxes, from which floats give their sides in half the bytes: metres, rounded outward
  /// but for what the subtraction loses, 2^-53 of it. None is further away, along x or y, than `reach`.
  Point origin{};
  double reach = 0;
  alignas(kLine) float bottom[kSlots] = {}, top[kSlots] = {};
  std::uint64_t ref[kSlots] = {};
  float west[kSlots] = {}, south[kSlots] = {}, east[kSlots] = {}, north[kSlots] = {};
  double xmin[kSlots] = {}, ymin[kSlots] = {}, xmax[kSlots] = {}, ymax[kSlots] = {};

  explicit LodPage(std::uint32_t page_level = kFree) : level(page_level) {}
  LodBox box(std::uint32_t s) const { return {xmin[s], ymin[s], xmax[s], ymax[s], bottom[s], top[s]}; }
  LodEntry entry(std::uint32_t s) const { return {box(s), {ref[s]}}; }
  std::uint32_t child(std::uint32_t s) const { return std::uint32_t(ref[s]); }
  void set_box(std::uint32_t s, const LodBox& b);
  void append(const LodEntry& e);  ///< REQUIRES: count < kSlots
  void remove(std::uint32_t s);    ///< the last entry takes its place
  LodBox bounds() const;           ///< REQUIRES: count > 0

  /// Asks memory for what every cut reads of a page: errors and ids, which lie at its beginning.
  void prefetch() const {
    for (std::size_t at = 0; at < offsetof(LodPage, west); at += kLine)
      __builtin_prefetch(reinterpret_cast<const char*>(this) + at);
  }
  /// Bit s is set for the slots in use.
  std::uint64_t used() const { return count == kSlots ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1; }
  /// Bit s is hit[s] (0 or 1) of the slots in use.
  std::uint64_t mask_of_used(const std::uint8_t (&hit)[kSlots]) const;
  /// The boxes that meet the closed region with bottom <= error < top; `in`: all are inside the region.
  LodHits uniform_hits(const Extent& region, float error, bool in) const;
  /// The box that grows least (volume, errors in octaves) when `box` joins it; ties by the smaller volume.
  std::uint32_t choose_slot(const LodBox& box) const;
  /// Keeps one part of its entries and `extra`, returns the other part. REQUIRES: count == kSlots.
  LodPage split(const LodEntry& extra);

  /// Fixed little-endian bytes (see lod_page.cpp), and back; `problem` says what is wrong with hostile ones.
  std::vector<std::byte> bytes() const;
  static LodPage from_bytes(std::span<const std::byte> bytes, std::string& problem);
};

}  // namespace patchwork
