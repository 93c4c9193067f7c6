// libFuzzer entry: overrides of a scene, "path=value", one a line.
#include "common/base/check.h"
#include "common/scene/scene_file.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::scene_override_fuzz {

extern "C" int FUZZ_ENTRY(scene_override)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  constexpr size_t kMostOverrides = 8;
  std::vector<std::string> overrides;
  while (!input.is_empty() && overrides.size() < kMostOverrides) overrides.push_back(input.take_line());
  const auto scene = built_in_scene_with(overrides);
  if (!scene) return 0;
  const auto again = parse_scene(to_text(*scene), "fuzz", {});
  CHECK(again.ok() && *again == *scene);
  const auto unchanged = with_overrides(*scene, {});
  CHECK(unchanged.ok() && *unchanged == *scene);
  return 0;
}

}  // namespace strandcast::scene_override_fuzz
