// Linked into every test and fuzzer of the preset `thread`, and the command: TBB works on the calling thread
// alone. Its library is not instrumented, so what it hands from thread to thread would look like races;
// threads that tests start themselves are watched.
#include <oneapi/tbb/global_control.h>

namespace {
const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
}

// GDAL and the validation layer take their own locks in either order, lavapipe and the layer destroy locks of
// theirs while they are let go; that is not ours to mend.
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "deadlock:libgdal.so\nrace:libvulkan_lvp.so\nrace:libVkLayer_khronos_validation.so\n"
         "deadlock:libVkLayer_khronos_validation.so\n";
}
