// Laws of meshes: OBJ reading, the scalp cap, the built-in head and fitted spheres.
#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/hash.h"
#include "common/groom/mesh.h"
#include "common/strands/head/head_field.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_mesh_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Result<ObjMesh> load(const std::string& text, float unit_m = 1.0f) {
  static const TemporaryFolder folder;
  return load_obj(folder.write("made.obj", text), unit_m);
}
std::string refusal(const std::string& text) {
  const auto mesh = load(text);
  if (mesh) return "accepted";
  EXPECT_THAT(mesh.error().to_string(), HasSubstr("made.obj"));
  return mesh.error().to_string();
}

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(Obj, ReadsEveryCornerForm) {
  const std::string rest = "vt 0 0\nvn 0 0 2\n";
  for (const char* face : {"f 1 2 3", "f 1/1 2/1 3/1", "f 1//1 2//1 3//1", "f 1/1/1 2/1/1 3/1/1",
                           "f -4 -3 -2", "f -4/-1/-1 -3/-1/-1 -2/-1/-1"}) {
    const auto mesh = load(kSquare + rest + face + "\n", 0.5f);
    ASSERT_TRUE(mesh) << face << ": " << mesh.error().to_string();
    ASSERT_EQ(mesh->triangle.size(), 1u);
    EXPECT_EQ(mesh->triangle[0], glm::uvec3(0, 1, 2)) << face;
    EXPECT_EQ(mesh->position_m[2], glm::vec3(0.5f, 0.5f, 0.0f));
    EXPECT_EQ(mesh->normal[0], glm::vec3(0, 0, 1)) << face;
    EXPECT_EQ(mesh->normal.size(), 4u);
  }
}

TEST(Obj, FansPolygonsAndSkipsOtherStatements) {
  const auto mesh = load("# head\r\nmtllib a.mtl\r\no Head\r\n" + kSquare +
                         "g a b\rs off\nusemtl skin\nl 1 2\nf 1 2 3 4\n");
  ASSERT_TRUE(mesh) << mesh.error().to_string();
  ASSERT_EQ(mesh->triangle.size(), 2u);
  EXPECT_EQ(mesh->triangle[1], glm::uvec3(0, 2, 3));
  // Colours after the coordinates are another program's; they are not coordinates.
  EXPECT_TRUE(load("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3"));
}

TEST(Obj, NamesLineAndOffendingWord) {
  EXPECT_THAT(refusal(kSquare + "f 1 2 9\n"),
              AllOf(HasSubstr(":5"), HasSubstr("vertex index 9 does not exist, 4 are")));
  EXPECT_THAT(refusal(kSquare + "f 0 1 2\n"), HasSubstr("vertex index 0"));
  EXPECT_THAT(refusal(kSquare + "f -5 1 2\n"), HasSubstr("vertex index -5"));
  EXPECT_THAT(refusal(kSquare + "f 1 2 99999999999999999999\n"), HasSubstr("'99999999999999999999'"));
  EXPECT_THAT(refusal(kSquare + "f 1 2 -9223372036854775808\n"), HasSubstr("does not exist"));
  EXPECT_THAT(refusal(kSquare + "f a b c\n"), HasSubstr("'a'"));
  EXPECT_THAT(refusal(kSquare + "f /1 /2 /3\n"), HasSubstr("vertex index is ''"));
  EXPECT_THAT(refusal(kSquare + "f 1 2\n"), HasSubstr("2 corners"));
  EXPECT_THAT(refusal(kSquare + "f\n"), HasSubstr("0 corners"));
  EXPECT_THAT(refusal("f 1 2 3\n" + kSquare), HasSubstr("0 are known up to here"));
  EXPECT_THAT(refusal("v 0 0\nf 1 1 1\n"), AllOf(HasSubstr(":1"), HasSubstr("''")));
  EXPECT_THAT(refusal("v 0 nan 0\n"), HasSubstr("'nan'"));
  EXPECT_THAT(refusal("v 0 1e400 0\n"), HasSubstr("'1e400'"));
  EXPECT_THAT(refusal("v 0 1e30 0\n"), HasSubstr("check the unit"));
  EXPECT_THAT(refusal("vn 0 inf 0\n"), HasSubstr("'inf'"));
  EXPECT_THAT(refusal(kSquare), HasSubstr("no faces"));
  EXPECT_THAT(refusal(""), HasSubstr("no faces"));
  EXPECT_FALSE(load(kSquare + "f 1 2 3", 0.0f));
  EXPECT_FALSE(load(kSquare + "f 1 2 3", NAN));
}

TEST(Obj, BadLinesAreLeftOutAndCounted) {
  std::string square = kSquare;
  for (int i = 0; i < 40; ++i) square += "f 1 2 3\n";
  const auto whole = load(square);
  ASSERT_TRUE(whole);
  EXPECT_TRUE(whole->notes.empty());
  const auto mesh = load(square + "v nan 0 0\nf 1 2 99\nf 5 2 3\nf 1 2");
  ASSERT_TRUE(mesh) << mesh.error().to_string();
  EXPECT_EQ(mesh->triangle, whole->triangle);
  ASSERT_EQ(mesh->notes.size(), 1u);
  EXPECT_THAT(mesh->notes.front(),
              AllOf(HasSubstr("4 of 48 lines"), HasSubstr("made.obj:45"), HasSubstr("'nan'")));
  // Faces of a vertex that cannot be read go with it: too many here.
  EXPECT_THAT(refusal("v nan 0 0\n" + square), HasSubstr("made.obj:1"));
}

TEST(Obj, NormalsThatAreNotThereAreComputed) {
  const auto mesh = load(kSquare + "f 1//1 2/1/ 3/3/3\n");
  ASSERT_TRUE(mesh) << mesh.error().to_string();
  EXPECT_EQ(mesh->normal.front(), load(kSquare + "f 1 2 3\n")->normal.front());
}

TEST(Obj, CommasMayPartNumbers) {
  EXPECT_EQ(load("v 1,2,3\nv 1, 0, 0\nv 0 1 0\nf 1 2 3\n")->position_m.front(), glm::vec3(1, 2, 3));
}

TEST(Obj, OtherFilesAreToldWhatIsRead) {
  const TemporaryFolder folder;
  for (const auto& [name, text, said] :
       {std::tuple("head.glb", "glTF", "it is binary glTF, which is not read"),
        {"head.stl", "solid", "only Wavefront .obj is read"}}) {
    const auto mesh = load_obj(folder.write(name, text), 1.0f);
    ASSERT_FALSE(mesh);
    EXPECT_THAT(mesh.error().to_string(), HasSubstr(said));
  }
}

TEST(Obj, StopsAtTheTriangleLimit) {
  std::string text = kSquare + "f";
  for (uint32_t i = 0; i < kMaxMeshTriangles + 2; ++i) text += " 1";
  EXPECT_EQ(load(text)->triangle.size(), kMaxMeshTriangles);
  EXPECT_THAT(refusal(text + " 1"), HasSubstr("more than 500000 triangles"));
}

TEST(Obj, RandomDamageNeverGivesIndicesOutOfRange) {
  const std::string good = kSquare + "vn 0 0 1\nf 1//1 2//1 3//1\nf -1 -2 -3 -4\n";
  const TemporaryFolder folder;
  for (uint32_t round = 0; round < 1'000; ++round) {
    std::string text = good;
    for (uint32_t change = 0; change < 1 + round % 4; ++change) {
      const uint32_t hash = mix_u32(round * 4 + change);
      text[hash % text.size()] = "0123456789-/ .\nvnf"[mix_u32(hash) % 18];
    }
    const auto mesh = load_obj(folder.write("a.obj", text), 1.0f);
    if (!mesh) continue;
    for (const auto& triangle : mesh->triangle) {
      ASSERT_LT(std::max({triangle.x, triangle.y, triangle.z}), mesh->position_m.size());
    }
  }
}

struct EdgeCount {
  size_t open = 0;      // directed edges without their opposite
  size_t repeated = 0;  // directed edges that occur twice
};
EdgeCount count_edges(const Mesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (const auto& t : mesh.triangle) {
    for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  EdgeCount count;
  for (const auto& [edge, times] : edges) {
    count.open += edges.count({edge.second, edge.first}) == 0 ? 1 : 0;
    count.repeated += times > 1 ? 1 : 0;
  }
  return count;
}

TEST(ScalpCap, IsAnEvenCapOfTheSphereOpenAtFaceAndNeck) {
  const glm::vec3 center(0.01f, 0.02f, -0.03f);
  for (const uint32_t target : {7u, 100u, 500u, 2000u, 20'000u}) {
    const Mesh cap = make_scalp_cap(center, 0.095f, target);
    EXPECT_NEAR(static_cast<double>(cap.position_m.size()), target, 0.15 * target + 4);
    for (size_t i = 0; i < cap.position_m.size(); ++i) {
      ASSERT_NEAR(glm::distance(cap.position_m[i], center), 0.095f, 1e-6f);
      ASSERT_NEAR(glm::distance(cap.normal[i], (cap.position_m[i] - center) / 0.095f), 0.0f, 1e-4f);
    }
    const EdgeCount edges = count_edges(cap);
    EXPECT_EQ(edges.repeated, 0u);
    EXPECT_GT(edges.open, 0u);
    // A disc: vertices - edges + triangles = 1.
    const size_t edge_count = (3 * cap.triangle.size() + edges.open) / 2;
    EXPECT_EQ(cap.position_m.size() + cap.triangle.size() - edge_count, 1u);
    if (target < 500) continue;
    double area = 0.0;
    float lowest_front = 1.0f, lowest_back = 1.0f;
    for (const auto& t : cap.triangle) {
      const glm::vec3 cross =
          glm::cross(cap.position_m[t.y] - cap.position_m[t.x], cap.position_m[t.z] - cap.position_m[t.x]);
      ASSERT_GT(glm::dot(cross, cap.normal[t.x]), 0.0f);  // counter-clockwise from outside
      area += 0.5 * glm::length(cross);
    }
    for (const auto& normal : cap.normal) {
      if (normal.z > 0.5f && std::abs(normal.x) < 0.3f) lowest_front = std::min(lowest_front, normal.y);
      if (normal.z < -0.5f) lowest_back = std::min(lowest_back, normal.y);
    }
    EXPECT_NEAR(area / (2.0 * 3.14159 * 0.095 * 0.095), 1.0, 0.1);  // half of the sphere
    EXPECT_GT(lowest_front, 0.4f);
    EXPECT_LT(lowest_back, -0.4f);
  }
}

TEST(Head, IsClosedSmoothAndOfHumanSize) {
  constexpr float kRadiusM = 0.095f;
  const Mesh head = make_head(kRadiusM);
  EXPECT_GE(head.triangle.size(), 5'000u);
  EXPECT_LE(head.triangle.size(), 35'000u);
  const EdgeCount edges = count_edges(head);
  EXPECT_EQ(edges.open, 0u);
  EXPECT_LE(edges.repeated, head.triangle.size() / 500);
  struct Box {
    glm::vec3 low{1.0f}, high{-1.0f};
  } head_box, neck_box, bust_box;
  for (size_t i = 0; i < head.position_m.size(); ++i) {
    ASSERT_NEAR(glm::length(head.normal[i]), 1.0f, 1e-4f);
    const glm::vec3& point = head.position_m[i];
    const float height = point.y / kRadiusM;
    Box& box = height > -1.4f ? head_box : (height > -1.7f ? neck_box : bust_box);
    box.low = glm::min(box.low, point);
    box.high = glm::max(box.high, point);
  }
  EXPECT_NEAR(head_box.high.y, kRadiusM, 0.03f * kRadiusM);
  EXPECT_NEAR(head_box.low.x, -head_box.high.x, 1e-3f * kRadiusM);  // symmetric
  EXPECT_NEAR(bust_box.low.x, -bust_box.high.x, 1e-3f * kRadiusM);
  EXPECT_GT(head_box.high.z, 1.1f * kRadiusM);   // the nose
  EXPECT_GT(head_box.low.z, -1.05f * kRadiusM);  // nothing behind the cranium
  EXPECT_LT(neck_box.high.x, 0.8f * kRadiusM);   // a neck
  // Shoulders of an adult: 0.36 m apart beside a head of 0.19 m.
  EXPECT_NEAR(bust_box.high.x, 1.9f * kRadiusM, 0.2f * kRadiusM);
  EXPECT_LT(bust_box.low.y, -3.5f * kRadiusM);
  double volume = 0.0;
  size_t agreeing = 0;
  for (const auto& t : head.triangle) {
    const glm::dvec3 a = head.position_m[t.x], b = head.position_m[t.y], c = head.position_m[t.z];
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    const glm::dvec3 face = glm::cross(b - a, c - a);
    const glm::dvec3 normal = head.normal[t.x] + head.normal[t.y] + head.normal[t.z];
    agreeing += glm::dot(face, normal) > 0.0 ? 1 : 0;
  }
  // Outward: a cranium of this radius alone holds 3.6 litres.
  EXPECT_GT(volume, 3.5e-3);
  EXPECT_LT(volume, 20e-3);
  EXPECT_GE(agreeing, head.triangle.size() * 995 / 1000);
}

TEST(Head, FitsUnderTheScalpCap) {
  const Mesh head = make_head(1.0f);
  const Mesh cap = make_scalp_cap(glm::vec3(0.0f), 1.0f, 3000);
  for (const auto& point : head.position_m) {
    const float radius = glm::length(point);
    float nearest = 1.0f;
    for (const auto& root : cap.position_m) nearest = std::min(nearest, glm::distance(point / radius, root));
    const bool is_ear =
        std::abs(point.x) > 0.93f && std::abs(point.y + 0.28f) < 0.3f && std::abs(point.z) < 0.25f;
    ASSERT_TRUE(nearest > 0.03f || radius < 1.0f || is_ear) << point.x << " " << point.y << " " << point.z;
  }
}

/// How far forward the profile lies at a height; both in cranium radii.
float profile_at(const Mesh& head, float height) {
  float furthest = -10.0f;
  for (const auto& t : head.triangle)
    for (int k = 0; k < 3; ++k) {
      const glm::vec3 a = head.position_m[t[k]], b = head.position_m[t[(k + 1) % 3]];
      if (std::abs(a.x) > 0.05f || (a.y - height) * (b.y - height) > 0.0f || a.y == b.y) continue;
      furthest = std::max(furthest, glm::mix(a.z, b.z, (height - a.y) / (b.y - a.y)));
    }
  return furthest;
}

// Down the middle of the face: out and in as on a person.
TEST(Head, HasTheProfileOfAFace) {
  const Mesh head = make_head(1.0f);
  const float brow = profile_at(head, -0.02f), root_of_nose = profile_at(head, -0.14f),
              nose = profile_at(head, -0.55f), under_nose = profile_at(head, -0.72f),
              lips = profile_at(head, -0.95f), dip = profile_at(head, -1.07f),
              chin = profile_at(head, -1.24f), throat = profile_at(head, -1.55f);
  EXPECT_LT(root_of_nose, brow);
  EXPECT_GT(nose, brow + 0.15f);
  EXPECT_LT(under_nose, nose - 0.12f);
  EXPECT_GT(lips, dip + 0.03f);
  EXPECT_GT(chin, dip);
  EXPECT_NEAR(chin, lips, 0.12f) << "neither a receding nor a jutting chin";
  EXPECT_LT(throat, chin - 0.4f);
}

TEST(Head, IsAsFarFromManyPointsAsFromOneAndTheSameOnBothSides) {
  for (const size_t count : {0u, 1u, 3u, 4u, 9u, 400u}) {
    std::vector<glm::vec3> points(count), mirrored(count);
    for (size_t i = 0; i < count; ++i) {
      const auto at = static_cast<float>(i);
      points[i] = {2.0f * std::sin(0.7f * at), -1.5f + 2.5f * std::sin(1.3f * at), std::sin(2.9f * at)};
      mirrored[i] = points[i] * glm::vec3(-1.0f, 1.0f, 1.0f);
    }
    const std::vector<float> distances = head_distances(points);
    ASSERT_EQ(distances.size(), count);
    EXPECT_EQ(head_distances(mirrored), distances);
    const std::vector<glm::vec3> normals = head_normals(points);
    ASSERT_EQ(normals.size(), count);
    for (size_t i = 0; i < count; ++i) {
      ASSERT_EQ(distances[i], head_distance(points[i])) << "point " << i << " of " << count;
      ASSERT_EQ(normals[i], head_normals({&points[i], 1}).front());
      ASSERT_EQ(glm::vec3(-normals[i].x, normals[i].y, normals[i].z),
                head_normals({&mirrored[i], 1}).front());
    }
  }
  EXPECT_NE(head_distance({0.5f, 0.0f, 0.9f}), head_distance({0.5f, 0.0f, -0.9f})) << "a face has a back";
}

TEST(Head, NearAPointIsMadeOfThePartsThere) {
  constexpr float kReach = 0.15f;
  const Mesh head = make_head(1.0f);
  const NearHead chest({0.0f, -3.5f, 0.3f}, kReach);
  size_t other_count = 0;
  for (size_t i = 0; i < head.position_m.size(); i += 41) {
    const auto at = static_cast<float>(i);
    const glm::vec3 about = head.position_m[i];
    std::vector<glm::vec3> points;
    for (const float turn : {0.0f, 2.0f, 4.0f, 6.0f, 8.0f})
      points.push_back(
          about + kReach *
                      glm::vec3(std::sin(at + turn), std::sin(2.1f * at + turn), std::sin(3.7f * at - turn)) /
                      1.8f);
    const NearHead near(about, kReach);
    ASSERT_EQ(near.distances(points), head_distances(points)) << i;
    ASSERT_EQ(near.normals(points), head_normals(points)) << i;
    other_count += chest.distances(points) == head_distances(points) ? 0 : 1;
  }
  EXPECT_GT(other_count, 100u) << "the parts of the chest alone make no face";
}

TEST(Head, ScalesWithItsRadius) {
  const Mesh small = make_head(0.08f), large = make_head(0.16f);
  ASSERT_EQ(small.position_m.size(), large.position_m.size());
  for (size_t i = 0; i < small.position_m.size(); i += 97) {
    EXPECT_NEAR(glm::distance(2.0f * small.position_m[i], large.position_m[i]), 0.0f, 1e-6f);
  }
}

TEST(FitSphere, FindsTheSphereOfExactAndNoisyPoints) {
  const glm::vec3 center(0.3f, 1.5f, -0.2f);
  for (const float noise : {0.0f, 0.002f}) {
    std::vector<glm::vec3> points;
    for (uint32_t i = 0; i < 500; ++i) {
      glm::vec3 direction(unit_float(mix_u32(5 * i + 1)) - 0.5f, unit_float(mix_u32(5 * i + 2)),
                          unit_float(mix_u32(5 * i + 3)) - 0.5f);  // the upper half only
      const float radius = 0.1f + noise * (unit_float(mix_u32(5 * i + 4)) - 0.5f);
      points.push_back(center + radius * glm::normalize(direction));
    }
    const FittedSphere sphere = fit_sphere(points);
    EXPECT_NEAR(glm::distance(sphere.center_m, center), 0.0f, noise + 1e-5f);
    EXPECT_NEAR(sphere.radius_m, 0.1f, noise + 1e-5f);
  }
}

TEST(FitSphere, DegenerateSetsGetABoundingSphere) {
  EXPECT_EQ(fit_sphere({}).radius_m, FittedSphere{}.radius_m);
  const FittedSphere point = fit_sphere({{1, 2, 3}});
  EXPECT_EQ(point.center_m, glm::vec3(1, 2, 3));
  EXPECT_EQ(point.radius_m, 0.0f);
  std::vector<glm::vec3> line, plane;
  for (int i = 0; i <= 10; ++i) line.push_back({0.1f * static_cast<float>(i), 0, 0});
  for (int i = 0; i < 100; ++i)
    plane.push_back({0.1f * static_cast<float>(i % 10), 0, 0.1f * static_cast<float>(i / 10)});
  EXPECT_NEAR(fit_sphere(line).radius_m, 0.5f, 1e-5f);
  EXPECT_NEAR(glm::distance(fit_sphere(line).center_m, glm::vec3(0.5f, 0, 0)), 0.0f, 1e-5f);
  EXPECT_NEAR(fit_sphere(plane).radius_m, 0.45f * std::sqrt(2.0f), 1e-5f);
  EXPECT_EQ(fit_sphere(std::vector<glm::vec3>(50, glm::vec3(2.0f))).radius_m, 0.0f);
}

}  // namespace
}  // namespace strandcast::groom_mesh_test
