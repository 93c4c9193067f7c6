#include "common/scene/scene_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <random>
#include <set>

#include "strandcast/v1/scene.pb.h"

namespace strandcast::scene_file_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

std::string error_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const auto scene = parse_scene(text, "s.textproto", overrides);
  return scene ? "no error" : scene.error().to_string();
}

/// A scene in which no field has its default, so that a forgotten field cannot hide.
SceneDesc unusual_scene() {
  SceneDesc s;
  s.name = "Zöpfe 2";
  FileGroomDesc file{.path = "../a folder/x.tfx",
                     .more_paths = {"b.tfx", "/c.hair"},
                     .unit_m = 0.1f,
                     .up_axis = UpAxis::MinusZ,
                     .has_up_axis = true,
                     .yaw_deg = -37.5f,
                     .has_yaw = true,
                     .origin = {1.5f, -2, 1e-3f},
                     .has_origin = true};
  file.vertex_count = 24;
  file.strand_vertex_count = 100;
  file.guides = true;
  file.pinning = Pinning::BothEnds;
  file.has_pinning = true;
  s.groom = file;
  s.head = {.mesh_path = "head.obj",
            .more_mesh_paths = {"eyes.obj"},
            .radius_m = 0.11f,
            .is_visible = false,
            .center_m = {0.1f, 0, -0.1f},
            .has_center = true,
            .collider = "field",
            .field_resolution = 77};
  s.solver = {.name = "other", .parameters = {{"damping", 0.1}, {"k", 1e-300}, {"sag_free", 0.25}}};
  s.step_rate_hz = 59.94005994005994;
  s.substeps = 3;
  s.gravity_mps2 = {0.1, -1.0 / 3.0, 2.0};
  s.colliders = {{{0.1f, 0.2f, 0.3f}, 0.05f}, {{}, 0.2f}};
  s.has_auto_collider = false;
  s.wind = {.mean_mps = {1, 2, 3}, .gust_intensity = 0.7f, .gust_length_m = 3.3f, .seed = 4'000'000'000u};
  s.look.hair_color = "melanin";
  s.look.root_color = {0.1f, 0.2f, 0.3f};
  s.look.tip_color = {0.4f, 0.5f, 0.6f};
  s.look.eumelanin = 0.25f;
  s.look.pheomelanin = 0.75f;
  s.look.strand_radius_m = 1e-4f;
  s.look.tip_scale = 0.7f;
  s.look.followers = 5;
  s.look.segments = 2;
  s.look.style = {.clump = 0.1f,
                  .locks = 7,
                  .spread = 0.2f,
                  .wave_m = 0.01f,
                  .wave_count = 4.5f,
                  .frizz_m = 0.002f,
                  .frizz_count = 11.0f,
                  .stray_share = 0.3f,
                  .stray_spread = 2.0f,
                  .length_spread = 0.4f,
                  .short_share = 0.5f,
                  .tip_fade = 0.6f};
  s.look.shading = {.diffuse = 0.1f,
                    .scatter = 0.2f,
                    .highlight = 0.3f,
                    .transmission = 0.4f,
                    .second_highlight = 0.6f,
                    .highlight_width_deg = 9.0f,
                    .cuticle_deg = 2.0f,
                    .cuticle_spread_deg = 3.0f,
                    .root_darkening = 0.7f,
                    .strand_variation = 0.8f,
                    .lock_variation = 0.9f,
                    .warmth_variation = 0.01f,
                    .wetness = 0.5f};
  s.look.light_direction = {0, -1, 0.3f};
  s.look.light_color = {2, 3, 4};
  s.look.rim_direction = {1, 0, -2};
  s.look.rim_color = {5, 6, 7};
  s.look.ambient = 0.5f;
  s.look.exposure = 1.5f;
  s.look.background = {0, 0.5f, 1};
  s.look.skin_color = {1, 0, 0.5f};
  s.look.methods = {.shading = "chiang",
                    .scattering = "isosurface",
                    .evaluation = "fragment",
                    .shadow = "volume",
                    .transparency = "hashed",
                    .antialiasing = "density_samples",
                    .curve = "bezier",
                    .joints = "split",
                    .detail = "decimation",
                    .culling = "occlusion",
                    .shadow_detail = "coarse"};
  s.camera = {.offset_m = {0, 0, 2}, .target_m = {0.1f, 0.2f, 0.3f}, .fov_y_rad = 1.0f};
  s.stream = {.codec = "raw",
              .has_codec = true,
              .bound_m = 2e-5f,
              .frame_width = 320,
              .frame_height = 200,
              .jpeg_quality = 33,
              .frame_rate_hz = 7.5,
              .strand_rate_hz = 30.0};
  s.follicle_limit_deg = 33.5;
  s.bend_limit = {.least_root_deg = 1.5, .least_tip_deg = 2.5, .most_root_deg = 20.5, .most_tip_deg = 60.5};
  s.volume = {.friction_per_s = 12.5,
              .repulsion_per_s2 = 3.5,
              .target_per_s2 = 77.0,
              .wind_width_m = 0.003,
              .rest_density_scale = 1.4,
              .resolution = 40,
              .smoothing = 2,
              .interval = 3,
              .integration = "explicit",
              .scatter = "atomics",
              .air = {.acts = true, .hairs = 80'000.0, .lock_width_m = 0.03}};
  s.wind.along_share = 0.25f;
  s.target_groom = ProceduralGroomDesc{.strand_count = 23, .vertex_count = 5, .length_m = 0.12f};
  s.detail = {.mode = "auto",
              .full_at_px = 301.5,
              .hysteresis = 0.4,
              .settle_s = 1.25,
              .simulated_share = 0.5,
              .far_share = 0.125,
              .idle = "full",
              .idle_after_s = 33.0};
  s.body = {.preset = "upper_body",
            .capsules = {{.from_joint = "neck",
                          .to_joint = "spine",
                          .from_m = {0.1, 0.2, 0.3},
                          .to_m = {0.4, 0.5, 0.6},
                          .from_radius_m = 0.07,
                          .to_radius_m = 0.08},
                         {}},
            .planes = {{.point_m = {1, 2, 3}, .normal = {0, 0, 1}, .velocity_mps = {4, 5, 6}}},
            .response = "sphere",
            .friction = 0.7,
            .tip_clearance_m = 0.006,
            .force_per_s2 = 900.0,
            .joint_offset_m = {0.01, 0.02, 0.03}};
  s.live = {{.protocol = "natnet",
             .host = "stage-7",
             .port = 1511,
             .subject = "Hut",
             .axes = "z_up",
             .version = "4.1",
             .takes_zero_positions = true,
             .turns_only = true,
             .delay_ms = 16.5,
             .max_datagram_bytes = 9'000},
            {.protocol = "vmc"}};
  s.place_m = {0.25, -1.5, 3.0};
  SceneDesc head = s;
  head.name = "ben";
  head.place_m = {-0.25, 0.0, 0.0};
  head.groom = ProceduralGroomDesc{.strand_count = 19};
  head.solver = {.name = "ftl", .parameters = {}};
  head.look.tip_scale = 0.3f;
  head.live = {{.protocol = "freed"}};
  s.heads = {head};
  return s;
}

TEST(SceneFile, EmptyTextIsTheDefaultScene) {
  const auto scene = parse_scene("", "s", {});
  ASSERT_TRUE(scene) << scene.error().to_string();
  EXPECT_EQ(*scene, with_overrides(SceneDesc{}, {"quality=auto"}).value())
      << "who says nothing leaves it to the machine";
}

TEST(SceneFile, TextRoundTripsExactly) {
  SceneDesc procedural = unusual_scene();
  procedural.groom = ProceduralGroomDesc{.strand_count = 17,
                                         .vertex_count = 9,
                                         .length_m = 0.1f,
                                         .length_variation = 0.3f,
                                         .curl_radius_m = 0.01f,
                                         .curl_turns = 1.7f,
                                         .seed = 99};
  for (const SceneDesc& scene : {SceneDesc{}, built_in_scene(), unusual_scene(), procedural}) {
    const auto again = parse_scene(to_text(scene), "s", {});
    ASSERT_TRUE(again) << again.error().to_string();
    EXPECT_EQ(*again, scene) << to_text(scene);
  }
}

TEST(SceneFile, OneLineAndALookAloneReadBackToo) {
  const std::string line = to_line(unusual_scene());
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const auto whole = parse_scene(line, "s", {});
  ASSERT_TRUE(whole) << whole.error().to_string();
  EXPECT_EQ(*whole, unusual_scene());

  const auto part = parse_scene(to_text(unusual_scene().look, unusual_scene().camera), "s", {});
  ASSERT_TRUE(part) << part.error().to_string();
  SceneDesc expected = with_overrides(SceneDesc{}, {"quality=auto"}).value();
  expected.look = unusual_scene().look;
  expected.camera = unusual_scene().camera;
  EXPECT_EQ(*part, expected) << "all else keeps its default";
  EXPECT_EQ(to_text(LookDesc{}, CameraDesc{}).find("groom"), std::string::npos) << "and is not said";
}

TEST(SceneFile, AbsolutePathsHoldWhereverTheSceneIsSaved) {
  SceneDesc scene;
  scene.groom = FileGroomDesc{.path = "hair/a.tfx", .more_paths = {"../b.tfx"}};
  scene.head.mesh_path = "/heads/bust.obj";
  scene.head.more_mesh_paths = {"eyes.obj"};
  const SceneDesc absolute = with_absolute_paths(scene);
  const auto& file = std::get<FileGroomDesc>(absolute.groom);
  const std::filesystem::path here = std::filesystem::current_path();
  EXPECT_EQ(file.path, here / "hair/a.tfx");
  EXPECT_EQ(file.more_paths.at(0), (here / "../b.tfx").lexically_normal());
  EXPECT_EQ(absolute.head.mesh_path, "/heads/bust.obj");
  EXPECT_EQ(absolute.head.more_mesh_paths.at(0), here / "eyes.obj");
  EXPECT_TRUE(with_absolute_paths(SceneDesc{}).head.mesh_path.empty()) << "no path stays none";
}

TEST(SceneFile, EveryProtoFieldIsReadAndWritten) {
  // Names of all fields reachable from Scene; each must be written for some scene, and (round trip above)
  // read back.
  std::set<std::string> names;
  std::function<void(const google::protobuf::Descriptor&)> walk =
      [&](const google::protobuf::Descriptor& type) {
        if (type.options().map_entry()) return;
        for (int i = 0; i < type.field_count(); ++i) {
          const bool is_new = names.insert(type.field(i)->name()).second;
          const auto* inner = type.field(i)->message_type();
          // A further head is a scene again.
          if (inner != nullptr && (is_new || inner != v1::Scene::descriptor())) walk(*inner);
        }
      };
  walk(*v1::Scene::descriptor());
  const std::string text = to_text(SceneDesc{}) + to_text(unusual_scene());
  for (const std::string& name : names)
    EXPECT_TRUE(text.find(name + ":") != std::string::npos || text.find(name + " {") != std::string::npos)
        << name;
  EXPECT_GT(names.size(), 50u);
}

TEST(SceneFile, MissingFieldsAndComponentsKeepTheirDefaults) {
  const auto scene = parse_scene(
      "gravity_mps2 { y: -1.62 } camera { offset_m { z: 2 } } groom { file { path: 'x' } }", "s", {});
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->gravity_mps2, glm::dvec3(0, -1.62, 0));
  EXPECT_EQ(scene->camera.offset_m, glm::vec3(CameraDesc{}.offset_m.x, CameraDesc{}.offset_m.y, 2.0f));
  FileGroomDesc named;
  named.path = "x";
  EXPECT_EQ(std::get<FileGroomDesc>(scene->groom), named);
}

TEST(SceneFile, ErrorsNameLineColumnAndWhatIsKnown) {
  EXPECT_THAT(error_of("name: 'a'\n  lenght_m: 3\n"), StartsWith("s.textproto:2:"));
  EXPECT_THAT(error_of("stream {\n  bound: 1\n}"), HasSubstr("no field named \"bound\""));
  EXPECT_THAT(error_of("stream {\n  bound: 1\n}"), HasSubstr("known: codec, bound_m,"));
  EXPECT_THAT(error_of("substeps: 'x'"), StartsWith("s.textproto:1:11: "));
  EXPECT_THAT(error_of("substeps: -1"), StartsWith("s.textproto:1:11: "));
  EXPECT_THAT(error_of("substeps: 1 substeps: 2"), StartsWith("s.textproto:1:"));
  EXPECT_THAT(error_of("groom { procedural {} file { path: 'x' } }"), StartsWith("s.textproto:1:"));
  EXPECT_THAT(error_of("groom { file { path: 'x' up_axis: X } }"), StartsWith("s.textproto:1:"));
  EXPECT_THAT(error_of("wind {"), StartsWith("s.textproto:1:"));
  EXPECT_THAT(error_of(std::string("\0\xff\x01", 3)), StartsWith("s.textproto:1:"));
}

TEST(SceneFile, RangeErrorsNamePlacePathValueAndRange) {
  EXPECT_EQ(error_of("wind {}\ngroom {\n  procedural { length_m: 99 }\n}"),
            "s.textproto:3:16: groom.procedural.length_m is 99, it must be within 0.005 .. 3 m");
  EXPECT_THAT(error_of("colliders { radius_m: 0.1 }\ncolliders { radius_m: -1 }"),
              StartsWith("s.textproto:2:13: colliders.1.radius_m is -1"));
  EXPECT_THAT(error_of("gravity_mps2 { y: nan }"), HasSubstr("gravity_mps2.y is nan"));
  EXPECT_THAT(error_of("gravity_mps2 { y: 1e999 }"), HasSubstr("gravity_mps2.y is inf"));
  EXPECT_THAT(error_of("look { root_color { g: 1.5 } }"), HasSubstr("look.root_color.g is 1.5"));
  EXPECT_THAT(error_of("stream { codec: 'h264' }"), HasSubstr("known: delta, raw, step, tangent"));
  EXPECT_EQ(
      error_of("look { methods { shading: 'phong' } }"),
      "s.textproto:1:18: look.methods.shading is unknown (known: main, sadeghi, kajiya_kay, karis, chiang, "
      "marschner)");
  EXPECT_THAT(error_of("look { methods { scattering: 'double' } }"),
              HasSubstr("scattering is unknown (known: main, volume, none, isosurface, dual)"));
  EXPECT_THAT(error_of("look { methods { evaluation: 'pixel' } }"),
              HasSubstr("evaluation is unknown (known: main, vertex, fragment)"));
  EXPECT_THAT(error_of("volume { scatter: 'hash' }"),
              HasSubstr("volume.scatter is unknown (known: auto, host, sort, atomics)"));
  EXPECT_THAT(error_of("camera { offset_m { x: 0 y: 0 z: 0 } }"),
              HasSubstr("camera.offset_m is almost zero"));
  EXPECT_THAT(error_of("groom { file { } }"), HasSubstr("--set groom.file.path=FILE"));
  EXPECT_THAT(error_of("groom { file { path: 'x' vertex_count: 1 } }"), HasSubstr("vertex_count is 1"));
  EXPECT_THAT(error_of("groom { file { path: 'x' up_axis: 7 } }"), HasSubstr("groom.file.up_axis is 7"));
  EXPECT_THAT(error_of("groom { procedural { strand_count: 200001 } }"), HasSubstr("within 1 .. 200000"));
  EXPECT_THAT(error_of("solver { parameters { key: 'd' value: inf } }"),
              HasSubstr("solver.parameters gives d"));
  EXPECT_THAT(error_of("name: 'line\\nbreak'"), HasSubstr("printable text"));
  EXPECT_THAT(error_of("name: '\\xff'"), testing::Ne("no error"));
  EXPECT_THAT(error_of("name: '" + std::string(65, 'a') + "'"), HasSubstr("1 .. 64 bytes"));
  std::string crowd;
  for (uint32_t i = 0; i <= kMaxSphereColliders; ++i) crowd += "colliders { }\n";
  EXPECT_THAT(error_of(crowd), HasSubstr("colliders has 17 entries, the limit is 16"));
}

TEST(SceneFile, RangeEndsAreIncluded) {
  for (const char* text :
       {"stream { bound_m: 1e-6 }", "stream { bound_m: 5e-4 }", "step_rate_hz: 1000",
        "groom { procedural { length_m: 0.005 } }", "groom { procedural { strand_count: 200000 } }"})
    EXPECT_EQ(error_of(text), "no error") << text;
  for (const char* text :
       {"stream { bound_m: 9.9e-7 }", "stream { bound_m: 5.01e-4 }", "step_rate_hz: 1000.001"})
    EXPECT_NE(error_of(text), "no error") << text;
}

TEST(SceneFile, OverridesReplaceWhatTheFileSays) {
  const auto scene =
      parse_scene("substeps: 2 colliders { radius_m: 0.1 }", "s",
                  {"substeps=4", "stream.bound_m=0.0005", "camera.offset_m.z=3",
                   "wind.mean_mps={ x: 2 z: 1 }", "colliders.0.center_m.y=0.5", "colliders.1.radius_m=0.2",
                   "solver.name=dftl_parallel", "solver.parameters.damping=0.25",
                   "groom.file.path=my = hair.tfx", "groom.file.up_axis=Z", "has_auto_collider=false"});
  ASSERT_TRUE(scene) << scene.error().to_string();
  EXPECT_EQ(scene->substeps, 4u);
  EXPECT_EQ(scene->stream.bound_m, 0.0005f);
  EXPECT_EQ(scene->camera.offset_m.z, 3.0f);
  EXPECT_EQ(scene->wind.mean_mps, glm::vec3(2, 0, 1));
  ASSERT_EQ(scene->colliders.size(), 2u);
  EXPECT_EQ(scene->colliders[0].center_m, glm::vec3(0, 0.5f, 0));
  EXPECT_EQ(scene->colliders[0].radius_m, 0.1f);
  EXPECT_EQ(scene->colliders[1].radius_m, 0.2f);
  EXPECT_EQ(scene->solver.name, "dftl_parallel");
  EXPECT_EQ(scene->solver.parameters.at("damping"), 0.25);
  EXPECT_EQ(std::get<FileGroomDesc>(scene->groom).path, "my = hair.tfx");
  EXPECT_EQ(std::get<FileGroomDesc>(scene->groom).up_axis, UpAxis::Z);
  EXPECT_FALSE(scene->has_auto_collider);
}

TEST(SceneFile, RatesOfOverridesAreAsPeopleWriteThem) {
  for (const auto& [text, hz] : {std::pair{"23.976", 24000.0 / 1001.0},
                                 {"24000/1001", 24000.0 / 1001.0},
                                 {"59.94", 60000.0 / 1001.0},
                                 {"25/2", 12.5},
                                 {"7.5", 7.5}}) {
    const auto scene = parse_scene("", "test", {fmt::format("stream.frame_rate_hz={}", text)});
    ASSERT_TRUE(scene) << text << ": " << scene.error().to_string();
    EXPECT_DOUBLE_EQ(scene->stream.frame_rate_hz, hz) << text;
  }
  EXPECT_THAT(parse_scene("", "test", {"stream.frame_rate_hz=24000/0"}).error().message,
              HasSubstr("write 24, 23.976 or 24000/1001"));
  EXPECT_FALSE(parse_scene("", "test", {"stream.frame_rate_hz=48000/100"})) << "beyond the field's own range";
}

TEST(SceneFile, OfTwoOverridesOfOneParameterTheLastCounts) {
  const auto scene = parse_scene(
      "solver { name: 'dftl' parameters { key: 'damping' value: 0.5 } parameters { key: 'sag_free' value: 1 "
      "} }",
      "s",
      {"solver.parameters.damping=0.25", "solver.parameters.sag_free=0.5",
       "solver.parameters.damping=0.125"});
  ASSERT_TRUE(scene) << scene.error().to_string();
  EXPECT_EQ(scene->solver.parameters, (std::map<std::string, double>{{"damping", 0.125}, {"sag_free", 0.5}}));
}

TEST(SceneFile, OverrideErrorsNameTheAssignmentAndKnownFields) {
  EXPECT_EQ(error_of("", {"stream.bound=1"}),
            "--set stream.bound=1: stream has no field \"bound\" (known: codec, bound_m, frame_width, "
            "frame_height, "
            "jpeg_quality, frame_rate_hz, strand_rate_hz)");
  EXPECT_THAT(error_of("", {"bogus=1"}), HasSubstr("a scene has no field \"bogus\" (known: name, groom,"));
  EXPECT_THAT(error_of("", {"substeps"}), HasSubstr("expected path=value"));
  EXPECT_THAT(error_of("", {"=1"}), HasSubstr("expected path=value"));
  EXPECT_THAT(error_of("", {"substeps=2 3"}), StartsWith("--set substeps=2 3: "));
  EXPECT_THAT(error_of("", {"substeps="}), StartsWith("--set substeps=: "));
  EXPECT_THAT(error_of("", {"substeps=0"}), StartsWith("--set substeps=0: substeps is 0"));
  EXPECT_THAT(error_of("", {"substeps.x=0"}), HasSubstr("single value"));
  for (const char* limit : {"0", "0.99", "180.5", "-20", "nan"})
    EXPECT_THAT(error_of("", {std::string("follicle_limit_deg=") + limit}), HasSubstr("1 .. 180 degrees"))
        << limit;
  EXPECT_THAT(error_of("", {"head.collider=capsule"}),
              HasSubstr("head.collider is unknown (known: field, spheres)"));
  EXPECT_THAT(error_of("", {"head.field_resolution=15"}), HasSubstr("16 .. 128 cells"));
  EXPECT_THAT(error_of("", {"camera=3"}), HasSubstr("known: offset_m, target_m, fov_y_rad"));
  EXPECT_THAT(error_of("", {"camera={ fov_y_rad: 9 }"}),
              StartsWith("--set camera={ fov_y_rad: 9 }: camera.fov_y_rad"));
  EXPECT_THAT(error_of("", {"groom.file.up_axis=X"}), HasSubstr("(known: Y, Z, MINUS_Y, MINUS_Z)"));
  EXPECT_THAT(error_of("", {"colliders.5.radius_m=1"}), HasSubstr("not an index"));
  EXPECT_THAT(error_of("", {"colliders.-1.radius_m=1"}), HasSubstr("not an index"));
  EXPECT_THAT(error_of("", {"colliders.99999999999999999999.radius_m=1"}), HasSubstr("not an index"));
  EXPECT_THAT(error_of("", {"colliders=1"}), HasSubstr("is a list"));
  EXPECT_THAT(error_of("", {"colliders.0=1"}), HasSubstr("is a list"));
  std::vector<std::string> too_many;
  for (uint32_t i = 0; i <= kMaxSphereColliders; ++i)
    too_many.push_back(fmt::format("colliders.{}.radius_m=0.1", i));
  EXPECT_THAT(error_of("", too_many),
              HasSubstr(fmt::format("is not an index of colliders (0 .. {})", kMaxSphereColliders - 1)));
  EXPECT_THAT(error_of("", {"solver.parameters=1"}), HasSubstr("is a list"));
  EXPECT_THAT(error_of("", {"groom.file.more_paths=b.tfx"}),
              HasSubstr("is not an index of groom.file.more_paths"));
  EXPECT_THAT(error_of("", {"groom.file.more_paths.1=b.tfx"}), HasSubstr("(0 .. 0)"));
  EXPECT_THAT(error_of("", {"solver.parameters.a=b"}), StartsWith("--set solver.parameters.a=b: "));
  EXPECT_THAT(error_of("", {"name=" + std::string(20'000, 'x')}), HasSubstr("the limit is 16384"));
  // A field set in the file is blamed on the file even when something else is overridden.
  EXPECT_THAT(error_of("substeps: 0", {"name=x"}), StartsWith("s.textproto:1:1: substeps"));
}

TEST(SceneFile, FurtherFilesAreListedAndCounted) {
  const auto scene = parse_scene("groom { file { path: 'a.tfx' more_paths: 'b.tfx' } }", "s",
                                 {"groom.file.more_paths.0=c.tfx", "groom.file.more_paths.1=d.tfx"});
  ASSERT_TRUE(scene) << scene.error().to_string();
  EXPECT_EQ(std::get<FileGroomDesc>(scene->groom).more_paths,
            (std::vector<std::filesystem::path>{"c.tfx", "d.tfx"}));
  std::string many = "groom { file { path: 'a' ";
  for (size_t i = 0; i < kMaxGroomFiles; ++i) many += "more_paths: 'b' ";
  EXPECT_THAT(error_of(many + "} }"), HasSubstr("groom.file.more_paths has 8 entries, the limit is 7"));
  EXPECT_THAT(error_of("groom { file { path: 'a' more_paths: '' } }"), HasSubstr("has an empty entry"));
  EXPECT_THAT(error_of("head { more_mesh_paths: 'eyes.obj' }"), HasSubstr("needs mesh_path"));
  EXPECT_THAT(error_of("groom { file { path: 'a' yaw_deg: 361 } }"), HasSubstr("-360 .. 360 degrees"));
}

TEST(SceneFile, RelativePathsStartAtTheScenesFolder) {
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("strandcast_scene_{}", getpid());
  std::filesystem::create_directories(folder);
  const auto path = folder / "s.textproto";
  std::ofstream(path) << "\xEF\xBB\xBF"  // as some editors begin a text
                         "groom { file { path: '../hair.tfx' more_paths: 'x.tfx' } } "
                         "head { mesh_path: '/abs/head.obj' more_mesh_paths: 'eyes.obj' }";
  const auto scene = load_scene(path, {});
  ASSERT_TRUE(scene) << scene.error().to_string();
  EXPECT_EQ(std::get<FileGroomDesc>(scene->groom).path, folder.parent_path() / "hair.tfx");
  EXPECT_EQ(std::get<FileGroomDesc>(scene->groom).more_paths.at(0), folder / "x.tfx");
  EXPECT_EQ(scene->head.mesh_path, "/abs/head.obj");
  EXPECT_EQ(scene->head.more_mesh_paths.at(0), folder / "eyes.obj");
  const auto typed = load_scene(path, {"groom.file.path=here.tfx"});
  ASSERT_TRUE(typed);
  EXPECT_EQ(std::get<FileGroomDesc>(typed->groom).path, "here.tfx");
  std::ofstream(path) << std::string(kMaxSceneFileBytes + 1, ' ');
  EXPECT_EQ(load_scene(path, {}).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(load_scene(folder / "none", {}).error().code, ErrorCode::NotFound);
  EXPECT_THAT(load_scene(folder / "none", {}).error().to_string(), HasSubstr("none"));
  std::filesystem::remove_all(folder);
}

TEST(SceneFile, BuiltInSceneIsValidAndTakesOverrides) {
  const auto same = built_in_scene_with({});
  ASSERT_TRUE(same) << same.error().to_string();
  EXPECT_EQ(*same, built_in_scene());
  const auto* groom = std::get_if<ProceduralGroomDesc>(&same->groom);
  ASSERT_TRUE(groom);
  EXPECT_EQ(groom->strand_count, 2000u);
  EXPECT_EQ(groom->vertex_count, 16u);
  EXPECT_NEAR(glm::length(same->wind.mean_mps), 1.5, 0.01);
  EXPECT_GT(same->wind.gust_intensity, 0.0f);
  EXPECT_TRUE(same->has_auto_collider);
  EXPECT_EQ(built_in_scene_with({"substeps=2"})->substeps, 2u);
  EXPECT_EQ(built_in_scene_with({"substeps=x"}).error().code, ErrorCode::BadInput);
  const auto again = with_overrides(unusual_scene(), {"stream.codec=delta"});
  ASSERT_TRUE(again) << again.error().to_string();
  EXPECT_EQ(again->stream.codec, "delta");
  EXPECT_EQ(again->solver, unusual_scene().solver);
}

// What the grown hair lets sag says nothing of a groom from a file: that one keeps its style, unless told.
TEST(SceneFile, AGroomFromAFileKeepsItsStyle) {
  const auto file = built_in_scene_with({"groom.file.path=hair.tfx"});
  ASSERT_TRUE(file) << file.error().to_string();
  EXPECT_EQ(file->solver.parameters.at("sag_free"), 1.0);
  const auto told = built_in_scene_with({"groom.file.path=hair.tfx", "solver.parameters.sag_free=0.4"});
  ASSERT_TRUE(told) << told.error().to_string();
  EXPECT_EQ(told->solver.parameters.at("sag_free"), 0.4);
  const auto grown = built_in_scene_with({"groom.procedural.strand_count=100"});
  EXPECT_EQ(grown->solver, built_in_scene().solver);
  const auto unsaid = parse_scene("groom { file { path: 'a.tfx' } }", "scene", {});
  ASSERT_TRUE(unsaid) << unsaid.error().to_string();
  EXPECT_EQ(unsaid->solver.parameters.at("sag_free"), 1.0);
  // A scene of a file says itself what that file gets.
  const std::string text =
      "groom { file { path: 'a.tfx' } } solver { parameters { key: 'sag_free' value: 0.2 } }";
  const auto stated = parse_scene(text, "scene", {"groom.file.path=b.tfx"});
  ASSERT_TRUE(stated) << stated.error().to_string();
  EXPECT_EQ(stated->solver.parameters.at("sag_free"), 0.2);
}

bool is_full(const SceneDesc& scene) {
  return scene.solver.name == "direct_rod" && scene.solver.parameters.at("sag_free") == 1.0 &&
         scene.volume.friction_per_s > 0.0 && scene.volume.repulsion_per_s2 > 0.0 && scene.volume.air.acts &&
         scene.head.collider == kFieldCollider;
}
bool is_fast(const SceneDesc& scene) {
  return scene.solver.name == "dftl" && !scene.volume.acts() && scene.head.collider == kSphereCollider;
}

// Who says nothing of the simulation leaves it to the machine; who says something gets just that.
TEST(SceneFile, AQualityStandsForSolverVolumeAirAndCollider) {
  const auto parsed = [](const std::string& text, const std::vector<std::string>& overrides = {}) {
    const auto scene = parse_scene(text, "scene", overrides);
    EXPECT_TRUE(scene) << scene.error().to_string();
    return scene.value();
  };
  EXPECT_EQ(parsed("name: 'a'").quality, kAutoQuality);
  EXPECT_TRUE(is_full(parsed("name: 'a'")));
  EXPECT_TRUE(is_full(parsed("quality: 'full' solver { name: 'pbd' } volume { interval: 7 }")));
  EXPECT_TRUE(is_fast(parsed("quality: 'fast' solver { name: 'pbd' } air { acts: true }")));
  EXPECT_EQ(parsed("solver { name: 'pbd' }").quality, kCustomQuality);
  EXPECT_EQ(parsed("solver { name: 'pbd' }").solver.name, "pbd");
  EXPECT_TRUE(is_fast(parsed("name: 'a'", {"quality=fast"})));
  EXPECT_THAT(parse_scene("quality: 'best'", "scene", {}).error().to_string(),
              HasSubstr("known: auto, fast"));
  // Beside a quality an override changes its field alone, and the scene is one's own.
  const SceneDesc more = parsed("name: 'a'", {"volume.friction_per_s=40"});
  EXPECT_TRUE(is_full(more));
  EXPECT_EQ(more.volume.friction_per_s, 40.0);
  EXPECT_EQ(more.quality, kCustomQuality);
  EXPECT_EQ(parse_scene(to_text(more), "again", {}).value(), more);
  // A model that is chosen by hand brings nothing, but for the rod.
  EXPECT_TRUE(!parsed("name: 'a'", {"solver.name=pbd"}).volume.acts());
  for (const SceneDesc& by_hand :
       {parsed("solver { name: 'direct_rod' }"), parsed("name: 'a'", {"solver.name=direct_rod"}),
        with_overrides(built_in_scene(), {"solver.name=direct_rod"}).value()}) {
    EXPECT_TRUE(by_hand.volume.has_contact() && by_hand.volume.air.acts);
    EXPECT_EQ(by_hand.quality, kCustomQuality);
  }
  EXPECT_FALSE(parsed("solver { name: 'direct_rod' } volume { interval: 2 }").volume.acts())
      << "told otherwise";
}

// What a quality stands for changes; a run that was recorded is simulated as it ran.
TEST(SceneFile, ARecordedSceneIsWhatItWasWhateverItsQualityStandsForNow) {
  SceneDesc older = with_overrides(built_in_scene(), {"quality=full"}).value();
  older.volume.rest_density_scale = 1.0;
  older.volume.resolution = 24;
  older.substeps = 3;
  EXPECT_EQ(parse_recorded_scene(to_line(older), "recording").value(), older);
  EXPECT_NE(parse_scene(to_line(older), "scene", {}).value(), older);
  for (const std::string quality : {"fast", "auto", "full"}) {
    const SceneDesc now = with_overrides(built_in_scene(), {"quality=" + quality}).value();
    EXPECT_EQ(parse_recorded_scene(to_line(now), "recording").value(), now) << quality;
  }
}

// A running scene changes by one assignment at a time, to what that stands for.
TEST(SceneFile, AQualityIsTakenWhenItIsSet) {
  SceneDesc scene = built_in_scene();
  scene = with_overrides(scene, {"quality=full"}).value();
  EXPECT_TRUE(is_full(scene));
  scene = with_overrides(scene, {"volume.friction_per_s=40"}).value();
  EXPECT_EQ(scene.quality, kCustomQuality);
  scene = with_overrides(scene, {"gravity_mps2.y=-3"}).value();
  EXPECT_EQ(scene.volume.friction_per_s, 40.0) << "nothing else changes it back";
  scene = with_overrides(scene, {"quality=fast"}).value();
  EXPECT_TRUE(is_fast(scene));
  EXPECT_EQ(scene.gravity_mps2.y, -3.0);
}

// Long steps take substeps in full quality, which go with it; those of one's own stay.
TEST(SceneFile, FastQualityDropsTheSubstepsOfFull) {
  const SceneDesc full = parse_scene("step_rate_hz: 30 quality: 'full'", "s", {}).value();
  EXPECT_EQ(full.substeps, 2u);
  const SceneDesc fast = with_overrides(full, {"quality=fast"}).value();
  EXPECT_EQ(fast.substeps, 1u);
  EXPECT_EQ(with_overrides(fast, {"quality=full"}).value().substeps, 2u);
  const SceneDesc own = with_overrides(full, {"substeps=3"}).value();
  EXPECT_EQ(with_overrides(own, {"quality=fast"}).value().substeps, 3u);
}

TEST(SceneFile, AFurtherHeadIsAsTheSceneWhereItSaysNothing) {
  const auto scene = parse_scene(
      "name: 'anna' groom { procedural { strand_count: 70 vertex_count: 9 } } "
      "solver { name: 'ftl' parameters { key: 'damping' value: 0.5 } } substeps: 3 "
      "look { hair_color: 'red' ambient: 0.5 } live { protocol: 'vmc' } place_m { x: -1 } colliders { "
      "radius_m: 0.2 } "
      "heads { name: 'ben' place_m { x: 1 } look { hair_color: 'blond' } } "
      "heads { name: 'cleo' groom { procedural { seed: 4 } } solver { name: 'dftl' } live { protocol: "
      "'freed' } }",
      "s", {"heads.1.look.ambient=0.125"});
  ASSERT_TRUE(scene) << scene.error().to_string();
  ASSERT_EQ(scene->heads.size(), 2u);
  SceneDesc ben = *scene;
  ben.heads.clear();
  ben.live.clear();
  ben.name = "ben";
  ben.place_m = {1, 0, 0};
  ben.look.hair_color = "blond";
  EXPECT_EQ(scene->heads[0], ben);
  SceneDesc cleo = ben;
  cleo.name = "cleo";
  cleo.place_m = glm::dvec3(0.0);
  cleo.groom = ProceduralGroomDesc{.seed = 4};
  cleo.solver = {.name = "dftl", .parameters = {}};
  cleo.look.hair_color = "red";
  cleo.look.ambient = 0.125f;
  cleo.live = {{.protocol = "freed"}};
  EXPECT_EQ(scene->heads[1], cleo);
}

TEST(SceneFile, WhatIsSetOfTheSceneItsFurtherHeadsHearToo) {
  const std::string text = "name: 'anna' heads { name: 'ben' } heads { name: 'cleo' substeps: 2 }";
  const auto scene = parse_scene(text, "s", {"substeps=5", "groom.file.path=x.tfx"});
  ASSERT_TRUE(scene) << scene.error().to_string();
  EXPECT_EQ(scene->heads[0].substeps, 5u);
  EXPECT_EQ(scene->heads[1].substeps, 2u);
  for (const SceneDesc& head : scene->heads) {
    EXPECT_EQ(head.groom, scene->groom);
    EXPECT_EQ(head.solver.parameters.at("sag_free"), 1.0) << "of a file";
  }
  // What has been completed stays as it is.
  const auto later = with_overrides(*scene, {"substeps=7"});
  ASSERT_TRUE(later) << later.error().to_string();
  EXPECT_EQ(later->substeps, 7u);
  EXPECT_EQ(later->heads, scene->heads);
}

TEST(SceneFile, WrongHeadsAreOneSentence) {
  EXPECT_THAT(error_of("name: 'anna' heads { name: 'anna' }"), HasSubstr("heads need a name each"));
  EXPECT_THAT(error_of("heads { } "), HasSubstr("heads need a name each"));
  EXPECT_THAT(error_of("heads { name: 'b' heads { name: 'c' } }"),
              HasSubstr("heads.0.heads: a further head"));
  EXPECT_THAT(error_of("heads { name: 'b' place_m { z: 1e9 } }"),
              AllOf(StartsWith("s.textproto:1:"), HasSubstr("heads.0.place_m.z is ")));
  std::string many;
  for (size_t i = 0; i < kMaxHeads; ++i) many += fmt::format("heads {{ name: '{}' }} ", i);
  EXPECT_THAT(error_of(many), HasSubstr("heads has 8 entries, the limit is 7"));
}

TEST(SceneFile, BrokenTextNeverCrashesAndAlwaysHasAPlace) {
  const std::string good = to_text(unusual_scene());
  std::mt19937 random(7);
  for (int round = 0; round < 3000; ++round) {
    std::string text = good;
    const int edits = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < edits; ++i) {
      const size_t where = random() % text.size();
      if (random() % 3 == 0)
        text.resize(where + 1);
      else if (random() % 2 == 0)
        text[where] = static_cast<char>(random());
      else
        text.insert(where, good.substr(random() % good.size(), random() % 40));
    }
    const auto scene = parse_scene(text, "s.textproto", {});
    if (scene) continue;
    EXPECT_THAT(scene.error().place, StartsWith("s.textproto"));
    EXPECT_FALSE(scene.error().message.empty());
  }
}

TEST(SceneFile, BrokenOverridesNeverCrash) {
  const std::vector<std::string> parts{
      "groom", "file", "path", "procedural", "colliders", "0",      "1",          "center_m", "x",    ".",
      "=",     "{",    "}",    "-1",         "nan",       "solver", "parameters", "1e999",    "\xff", ""};
  std::mt19937 random(11);
  for (int round = 0; round < 3000; ++round) {
    std::string assignment;
    for (uint32_t i = 0; i < 1 + random() % 8; ++i) {
      assignment += parts[random() % parts.size()];
      if (random() % 2) assignment += random() % 3 ? "." : "=";
    }
    const auto scene = built_in_scene_with({assignment});
    if (scene) continue;
    EXPECT_FALSE(scene.error().message.empty());
  }
}

TEST(SceneFile, WrongBodiesAreNamed) {
  const auto refusal = [](const char* text) {
    const auto scene = parse_scene(text, "s", {});
    return scene ? std::string("taken") : scene.error().to_string();
  };
  EXPECT_EQ(refusal("body { preset: \"upper_body\" }"), "taken");
  EXPECT_THAT(refusal("body { preset: \"dress\" }"),
              testing::HasSubstr("body.preset is unknown (known: none, upper_body)"));
  EXPECT_THAT(refusal("body { response: \"bounce\" }"),
              testing::HasSubstr("body.response is unknown (known: turn, sphere, project, force)"));
  EXPECT_THAT(refusal("body { friction: -1 }"), testing::HasSubstr("body.friction is -1"));
  EXPECT_THAT(refusal("body { tip_clearance_m: 1 }"), testing::HasSubstr("body.tip_clearance_m is 1"));
  EXPECT_THAT(refusal("body { capsules { from_radius_m: 0 } }"),
              testing::HasSubstr("body.capsules.0.from_radius_m is 0"));
  EXPECT_THAT(refusal("body { capsules { to_joint: \"\" } }"),
              testing::HasSubstr("body.capsules.0.to_joint must be"));
  EXPECT_THAT(refusal("body { planes { normal { x: 0 y: 0 z: 0 } } }"),
              testing::HasSubstr("body.planes.0.normal must point somewhere"));
  EXPECT_THAT(refusal("body { planes {} planes {} planes {} planes {} planes {} }"),
              testing::HasSubstr("body.planes has 5 entries, the limit is 4"));
  std::string many = "body { preset: \"upper_body\" ";
  for (size_t i = preset_size("upper_body"); i < kMaxBodyCapsules; ++i) many += "capsules {} ";
  EXPECT_EQ(refusal((many + "}").c_str()), "taken");
  EXPECT_THAT(refusal((many + "capsules {} }").c_str()),
              testing::HasSubstr("body.capsules with those of the preset are more than 16"));
}

TEST(BodyDesc, CapsulesAreWhereTheirJointsAreAndWhatIsMissingIsNamed) {
  BodyDesc body;
  body.joint_offset_m = {0.0, -0.1, 0.0};
  body.capsules.resize(2);
  body.capsules[0].from_joint = "neck";
  body.capsules[0].from_m = {0.0, 0.0, 0.02};
  body.capsules[0].to_m = {0.0, -0.5, 0.0};
  body.capsules[1].from_joint = "tail";
  body.capsules[1].to_joint = "neck";
  const BodyShapes shapes = shapes_of(body, {{"chest", "neck"}, {{9, 9, 9}, {0.1, 0.2, 0.3}}});
  ASSERT_EQ(shapes.capsules.size(), 1u);
  EXPECT_EQ(shapes.capsules[0].from_m,
            glm::dvec3(0.1, 0.2, 0.3) + glm::dvec3(0.0, -0.1, 0.0) + glm::dvec3(0, 0, 0.02));
  EXPECT_EQ(shapes.capsules[0].to_m, glm::dvec3(0.0, -0.5, 0.0)) << "head space, where no joint is named";
  EXPECT_EQ(
      shapes.missing,
      std::vector<std::string>(
          {"body.capsules.1.from_joint: the motion stream has no joint \"tail\" (it has chest, neck)"}));
  body = BodyDesc();
  body.preset = kUpperBody;
  EXPECT_TRUE(shapes_of(body, {}).capsules.empty());
  EXPECT_EQ(shapes_of(body, {}).missing.front(),
            "body.preset upper_body: the motion stream has no joint \"neck\" (it has none)");
}

}  // namespace
}  // namespace strandcast::scene_file_test
