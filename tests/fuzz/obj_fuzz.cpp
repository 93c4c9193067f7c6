// libFuzzer entry: a Wavefront OBJ mesh.
#include "common/base/check.h"
#include "common/groom/mesh.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::obj_fuzz {

extern "C" int FUZZ_ENTRY(obj)(const uint8_t* data, size_t size) {
  const auto mesh = parse_obj(FuzzInput(data, size).take_rest_as_text(), "fuzz", 0.01f);
  if (!mesh) return 0;
  CHECK(!mesh->triangle.empty() && mesh->triangle.size() <= kMaxMeshTriangles);
  CHECK(mesh->normal.size() == mesh->position_m.size());
  for (const glm::uvec3& triangle : mesh->triangle)
    for (int i = 0; i < 3; ++i) CHECK(triangle[i] < mesh->position_m.size());
  for (const glm::vec3& point : mesh->position_m)
    for (int i = 0; i < 3; ++i) CHECK(std::abs(point[i]) <= 1000.0f * kMaxMeshExtentM);
  constexpr float kTolerance = 1e-3f;
  for (const glm::vec3& normal : mesh->normal) CHECK(std::abs(glm::length(normal) - 1.0f) <= kTolerance);
  return 0;
}

}  // namespace strandcast::obj_fuzz
