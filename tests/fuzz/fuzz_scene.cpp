// Scenes: refused with a place and a reason, or parsed.
#include "db/error.h"
#include "render/scene.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace patchwork;
  try {
    const Scene scene = parse_scene(std::string(reinterpret_cast<const char*>(data), size), "input");
    fuzz::require(scene.width > 0 && scene.height > 0, "a picture has pixels");
    fuzz::require(scene.pixel_error >= 0 && scene.smoothness >= 0 && scene.smoothness <= 2,
                  "numbers in range");
    fuzz::require(!(scene.camera && scene.path), "one way of looking");
  } catch (const Error& e) {
    fuzz::require(e.what()[0] != '\0', "a refusal has a reason");
  }
  return 0;
}
