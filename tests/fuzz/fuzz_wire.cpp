// Updates as a client receives them: refused, or patches that can be looked at.
#include <cmath>

#include "db/error.h"
#include "query/wire.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace patchwork;
  try {
    const Update update = decode_update(std::as_bytes(std::span(data, size)));
    for (const Update::Patch& p : update.add) {
      fuzz::require(std::isfinite(p.bottom) && p.bottom >= 0, "bottoms are errors");
      for (const float code : p.surface.codes) fuzz::require(std::isfinite(code), "codes are numbers");
    }
  } catch (const Error&) {
  }
  return 0;
}
