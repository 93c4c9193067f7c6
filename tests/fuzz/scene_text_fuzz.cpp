// libFuzzer entry: a scene file. A scene that is accepted must come back equal from its own text.
#include "common/base/check.h"
#include "common/scene/scene_file.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::scene_text_fuzz {

extern "C" int FUZZ_ENTRY(scene_text)(const uint8_t* data, size_t size) {
  const auto scene = parse_scene(FuzzInput(data, size).take_rest_as_text(), "fuzz", {});
  if (!scene) return 0;
  const auto again = parse_scene(to_text(*scene), "fuzz", {});
  CHECK(again.ok() && *again == *scene);
  return 0;
}

}  // namespace strandcast::scene_text_fuzz
