// A 128-bit digest of values fed one by one (used by import.cpp and database.cpp).
#pragma once

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cstddef>

#include "db/grid.h"

namespace patchwork {

class DigestBuilder {
 public:
  DigestBuilder() { XXH3_128bits_reset(state_); }
  ~DigestBuilder() { XXH3_freeState(state_); }
  DigestBuilder(const DigestBuilder&) = delete;
  DigestBuilder& operator=(const DigestBuilder&) = delete;
  template <class T>
  void add(const T* data, std::size_t n) {
    XXH3_128bits_update(state_, data, n * sizeof(T));
  }
  Digest get() const {
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(state_));
    Digest d;
    std::copy(std::begin(canonical.digest), std::end(canonical.digest), d.begin());
    return d;
  }

 private:
  XXH3_state_t* state_ = XXH3_createState();
};

}  // namespace patchwork
