// First inputs for files and texts that people bring.
#include <cmath>

#include "common/scene/scene_file.h"
#include "tests/fuzz/seed_folder.h"
#include "tests/support/made_abc.h"
#include "tests/support/made_usdc.h"
#include "tests/support/proxy_header.h"
#include "tests/support/sample_asset.h"
#include "tests/support/sample_recording.h"
#include "tests/support/temporary_folder.h"

namespace strandcast {
namespace {

using Bytes = SeedBytes;

void add_grooms(const SeedFolder& seeds) {
  constexpr uint32_t kStrands = 2, kVertices = 3;
  Bytes points;
  Bytes points_with_mass;
  for (uint32_t i = 0; i < kStrands * kVertices; ++i) {
    const Bytes point = packed(0.1f * static_cast<float>(i / kVertices), 0.1f * static_cast<float>(i), 0.5f);
    points = joined({points, point});
    points_with_mass = joined({points_with_mass, point, packed(i % kVertices == 0 ? 0.0f : 1.0f)});
  }
  const Bytes uv(kStrands * 2 * sizeof(float));
  constexpr uint32_t kHeader4Bytes = 160, kHeader3Bytes = 296;
  Bytes tfx4 = packed(4.0f, kStrands, kVertices, kHeader4Bytes,
                      kHeader4Bytes + static_cast<uint32_t>(points_with_mass.size()));
  tfx4.resize(kHeader4Bytes);
  seeds.add("tfx", "version_4", joined({tfx4, points_with_mass, uv}));
  Bytes tfx3 = packed(3.0f, kStrands, kVertices, uint32_t{0}, int32_t{1});
  constexpr uint32_t kPointsAt = 144, kUvAt = 152;
  tfx3.resize(kHeader3Bytes);
  std::memcpy(tfx3.data() + kPointsAt, &kHeader3Bytes, sizeof(uint32_t));
  const uint32_t uv_at = kHeader3Bytes + static_cast<uint32_t>(points.size());
  std::memcpy(tfx3.data() + kUvAt, &uv_at, sizeof(uint32_t));
  seeds.add("tfx", "version_3", joined({tfx3, points, uv}));
  seeds.add("tfx_text", "two_strands",
            "version 2.0\nscale 1.0\nbothEndsImmovable 0\nmaxNumVerticesInStrand 16\nnumStrands 2\n"
            "is sorted 1\nstrand 0 numVerts 3 texcoord 0.25 0\n0 0 0\n0 1 0\n0 2.5e-1 -1.5\n"
            "strand 1 numVerts 2 texcoord .5 1\n1 0 0\n1 +1 0\n");

  constexpr uint32_t kSegments = 1, kPoints = 2, kThickness = 4;
  constexpr size_t kHairHeaderBytes = 128;
  for (const uint32_t arrays : {kPoints, kPoints | kSegments | kThickness}) {
    Bytes hair = joined({bytes_of("HAIR"), packed(kStrands, kStrands * kVertices, arrays, kVertices - 1)});
    hair.resize(kHairHeaderBytes);
    if ((arrays & kSegments) != 0) hair = joined({hair, packed(uint16_t{2}, uint16_t{2})});
    hair = joined({hair, points});
    if ((arrays & kThickness) != 0) hair.resize(hair.size() + kStrands * kVertices * sizeof(float));
    seeds.add("hair", fmt::format("arrays_{}", arrays), hair);
  }
  seeds.add("obj", "tetrahedron",
            "# a comment\nv 0 1 0\nv 1 0 0\nv 0 0 1\nv -1 0 0\nvn 0 1 0\nvt 0 0\nf 1//1 2//1 3//1\n"
            "f 1 3 4\nf -1 -2 -3 -4\ng name\n");
}

void add_curves(const SeedFolder& seeds) {
  const std::string points = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string rows = "0 0 0\n0 1 0\n0 2.5e-1 -1.5\n1 0 0\n1 +1 0\n";
  const auto ply = [&](const std::string& name, uint8_t count, const std::string& elements,
                       const std::string& more_rows) {
    seeds.add("ply", name,
              joined({packed(count), bytes_of("ply\nformat ascii 1.0\n" + elements + "end_header\n" + rows),
                      bytes_of(more_rows)}));
  };
  ply("points", 5, "comment unit_m 0.01\ncomment up_axis Z\n" + points, "");
  ply("guessed", 0, points, "");
  ply("segments", 0, points + "element strand 2\nproperty ushort nsegs\n", "2\n1\n");
  ply("lists", 0, points + "element curve 2\nproperty list uchar int vertex_indices\n", "3 0 1 2\n2 3 4\n");
  ply("edges", 0, points + "element edge 3\nproperty int vertex1\nproperty int vertex2\n", "0 1\n2 1\n4 3\n");
  const std::string binary =
      "element vertex 2\nproperty double x\nproperty float y\nproperty uchar red\n"
      "property float z\nelement strand 1\nproperty list uchar ushort vertices\nend_header\n";
  seeds.add("ply", "binary",
            joined({packed(uint8_t{0}), bytes_of("ply\nformat binary_little_endian 1.0\n" + binary),
                    packed(0.5, 1.0f, uint8_t{9}, 2.0f), packed(0.25, 1.0f, uint8_t{9}, 3.0f),
                    packed(uint8_t{2}, uint16_t{1}, uint16_t{0})}));
  seeds.add("ply", "big_endian",
            joined({packed(uint8_t{2}), bytes_of("ply\nformat binary_big_endian 1.0\n" + binary),
                    Bytes(2 * 17), packed(uint8_t{1}, uint16_t{0})}));
  seeds.add(
      "usda", "linear",
      "#usda 1.0\n(\n doc = \"\"\"a\n}\"\"\"\n metersPerUnit = 0.01\n upAxis = \"Z\"\n)\n"
      "def Xform \"a\" ( kind = \"component\" )\n{\n double3 xformOp:translate:pivot = (1, 2, 3)\n"
      " float3 xformOp:rotateXYZ.timeSamples = { 1: (10, 20, 30), 2: (0, 0, 0), }\n"
      " uniform token[] xformOpOrder = [\"xformOp:translate:pivot\", \"xformOp:rotateXYZ\", "
      "\"!invert!xformOp:translate:pivot\"]\n def BasisCurves \"b\" {\n uniform token type = \"linear\"\n"
      "  int[] curveVertexCounts = [3, 2]\n  float[] widths = [0.1] ( interpolation = \"constant\" )\n"
      "  point3f[] points = [(0, 0, 0), (0, 0, 1), (0, 1, 2.5e0), (1, 0, 0), (1, 0, -1)]\n }\n}\n");
  for (const char* const basis : {"bezier", "bspline", "catmullRom"})
    seeds.add(
        "usda", basis,
        fmt::format("#usda 1.0\ndef BasisCurves \"b\" {{ uniform token basis = \"{}\" uniform token wrap = "
                    "\"{}\" int[] curveVertexCounts = [4] point3f[] points.timeSamples = {{ -1.5: [(0,0,0), "
                    "(0,0,1), (0,1,2), (1,0,0)], 2: None, }} }}",
                    basis, basis[0] == 'b' ? "nonperiodic" : "pinned"));
  seeds.add("usda", "tree",
            "#usda 1.0\nclass \"c\" {}\nover \"o\" ( active = false ) { custom rel r = </c> }\n"
            "def \"v\" ( prepend references = @a.usd@</x> (offset = 1) ) { variantSet \"s\" = { \"o\" { } }\n"
            "reorder nameChildren = [\"a\"]\n matrix4d xformOp:transform = "
            "((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))\n"
            "uniform token[] xformOpOrder = [\"!resetXformStack!\", \"xformOp:transform\"]\n"
            "def BasisCurves \"b\" { token type = \"linear\" int[] curveVertexCounts = [2] "
            "point3f[] points = [(0,0,0), (0,0,1)] token outputs:x } }\n");
}

void add_alembic(const SeedFolder& seeds) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "seed.abc";
  const std::vector<int16_t> guides = {1, 0};
  const std::vector<float> widths = {0.1f, 0.05f}, knots = {0, 0, 0, 0, 1, 2, 2, 2, 2};
  const std::vector<glm::vec2> values = {{0.25f, 0.5f}, {0.75f, 1.0f}};
  const std::vector<uint32_t> indices = {1, 0};
  {
    test::MadeAbc file(path);
    seeds.add("abc", "linear", file.finish({file.curves({})}, "unit_m=0.01;up_axis=Z"));
  }
  {
    test::MadeAbc file(path);
    test::MadeCurves moving;
    moving.shift = {0, 1, 2};
    auto source = file.xform({0x10, 0x40, 0x20, 0x00}, {1, 0, 0, 90, 0, 1, 0, 45, 1, 2, 1}, true,
                             {file.curves(moving, {file.param("width", AbcType::Float, 1, widths, "uni")},
                                          {file.param("groom_guide", AbcType::I16, 1, guides, "uni"),
                                           file.param("groom_root_uv", AbcType::Float, 2, values)})});
    source.name = "source";
    seeds.add("abc", "instance", file.finish({std::move(source), file.instance("copy", "/source")}));
  }
  for (const uint8_t type : {uint8_t{0}, uint8_t{2}}) {
    test::MadeAbc file(path);
    test::MadeCurves spline;
    spline.kinds = {type, 0, 2, 2};
    spline.counts = {5};
    std::vector<AbcEntry> own = {file.entry(".knots", AbcForm::Array, AbcType::Float, 1, knots)};
    if (type == 2)
      own.push_back(file.entry(".orders", AbcForm::Array, AbcType::U8, 1, std::array{uint8_t{4}}));
    own.push_back(test::MadeAbc::compound("uv", {file.param(".vals", AbcType::Float, 2, values),
                                                 file.param(".indices", AbcType::U32, 1, indices)}));
    seeds.add("abc", type == 0 ? "bspline" : "orders", file.finish({file.curves(spline, std::move(own))}));
  }
}

/// Curves in a transform, as a version of the format has its numbers.
std::string made_usdc(uint8_t minor, bool is_packed) {
  using test::MadeUsdc;
  using test::raw_bytes;
  MadeUsdc file(minor);
  std::vector<glm::vec3> points;
  std::vector<int32_t> table_index;
  for (int i = 0; i < 36; ++i) points.emplace_back(i / 2, i % 2, i % 2);
  for (int i = 0; i < 36; ++i) table_index.push_back(i % 2);
  const std::string table = "t" + raw_bytes(std::vector<uint32_t>{2}) +
                            raw_bytes(std::vector<float>{0.1f, 0.2f}) + MadeUsdc::packed_ints(table_index);
  const uint64_t still = file.array(24, points.size(), raw_bytes(points));
  std::vector<test::MadeSpec> items = {
      MadeUsdc::attribute("type", file.token("linear")),
      MadeUsdc::attribute("curveVertexCounts", file.ints(std::vector<int32_t>(18, 2))),
      is_packed ? MadeUsdc::moving("points", file.samples({1.5, 2.0}, {still, MadeUsdc::rep(51, 0)}))
                : MadeUsdc::attribute("points", still),
      MadeUsdc::attribute("widths", is_packed ? file.array(8, points.size(), table, MadeUsdc::kPacked)
                                              : file.array(8, 1, raw_bytes(std::vector<float>{0.1f})))};
  std::vector<test::MadeSpec> xform = {
      MadeUsdc::attribute("xformOp:scale", MadeUsdc::inlined(24, 0x01'02'fe)),
      MadeUsdc::attribute("xformOp:orient", file.scalar(17, raw_bytes(std::vector<float>{0, 0, 1, 0.5f}))),
      MadeUsdc::attribute("xformOpOrder", file.tokens({"xformOp:scale", "xformOp:orient"})),
      file.prim("Hair", "BasisCurves", std::move(items))};
  return file.finish({file.prim("Head", "Xform", std::move(xform)), file.prim("n", "NurbsCurves", {})},
                     {{"upAxis", file.token("Z")}, {"metersPerUnit", MadeUsdc::inlined(9, 0x3f000000)}});
}

void add_usdc(const SeedFolder& seeds) {
  seeds.add("usdc", "version_4", made_usdc(4, false));
  seeds.add("usdc", "version_6", made_usdc(6, true));
  seeds.add("usdc", "version_8", made_usdc(8, true));
  const std::string name = "a.usd",
                    layer =
                        "#usda 1.0\ndef BasisCurves \"b\" { uniform token type = \"linear\" "
                        "int[] curveVertexCounts = [2] point3f[] points = [(0,0,0), (0,0,1)] }";
  const auto size = static_cast<uint32_t>(layer.size());
  seeds.add("usdc", "package",
            joined({bytes_of("PK\3\4"), Bytes(14), packed(size, size, static_cast<uint32_t>(name.size())),
                    bytes_of(name + layer)}));
}

void add_texts(const SeedFolder& seeds) {
  const std::string bvh =
      "HIERARCHY\nROOT Hips\n{\n OFFSET 9 9 9\n CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation "
      "Xrotation\n JOINT Neck\n {\n  OFFSET 0 1 0\n  CHANNELS 3 Zrotation Yrotation Xrotation\n"
      "  JOINT Head\n  {\n   OFFSET 0 1 .5\n   CHANNELS 3 Zrotation Yrotation Xrotation\n"
      "   End Site\n   {\n    OFFSET 0 1 0\n   }\n  }\n }\n}\nMOTION\nFrames: 3\nFrame Time: .0083333\n"
      "1 2 3 0 0 0 0 0 0 0 0 0\n1 2 3 10 20 30 1 2 3 4 5 6\n4 5 6 0 0 0 0 0 0 0 0 0\n";
  for (const uint8_t settings : {0, 7, 12})
    seeds.add("bvh", fmt::format("settings_{}", settings), joined({packed(settings), bytes_of(bvh)}));
  seeds.add("wind_csv", "world", "# gusts\nt_s,x_mps,y_mps,z_mps\n0,1,0,0\n0.1,1.5,-2,1e-3\n\n0.25,2,0,0\n");
  seeds.add("wind_csv", "logger", "logger_ms,u,v,w,t\n1000,1,2,3,20\n1010,1.5,2,3,20\n");
  seeds.add("scene_text", "built_in", to_text(built_in_scene()));
  seeds.add("scene_text", "file_groom",
            "name: \"a\" groom { file { path: \"hair.tfx\" unit_m: 0.63 up_axis: Z origin { y: 0.7 } "
            "vertex_count: 16 pinning: BOTH_ENDS } } colliders { radius_m: 0.08 } has_auto_collider: false "
            "solver { name: \"xpbd\" parameters { key: \"a\" value: 1e-3 } }");
  seeds.add("scenario_text", "every_action",
            "name: \"all\" about: \"a\" limit_s: 12.5 repeat: 2 "
            "do { start { scene: \"a.textproto\" set: \"substeps=2\" lockstep: true option: \"--x\" } } "
            "do { feed { motion: \"shake\" wind: \"steady\" wind_mps { x: 2 } } } do { step: 240 } "
            "do { run_s: 0.5 } do { set: \"a=b\" } do { command: RESTART } do { view { mode: \"auto\" "
            "link_mbit: 2 } } do { leave: \"v\" } do { refuse { input: OVERLONG says: \"no\" } } "
            "do { remember: \"r\" } do { expect { stretch_below: 0.01 no_quarantine: true hash: \"ff\" "
            "picture { golden: \"a.png\" } metric { name: \"m\" above: 1 } } }");
  seeds.add("scene_override", "numbers",
            "stream.bound_m=0.0002\nsolver.parameters.damping=0.9\nsubsteps=2\n");
  seeds.add("scene_override", "groups",
            "colliders.0.radius_m=0.1\ncolliders.0.center_m={ x: 1 y: 2 }\nsolver.name=dftl\n"
            "groom.file.path=a.tfx\ngroom.file.up_axis=Z\n");
  seeds.add("token_file", "roles",
            "\1secret-of-steering\n# made\nviewer secret-of-viewing\ncontroller secret-of-steering\n"
            "source secret-of-feeding\nadmin secret-of-everything\n");
  seeds.add("token_file", "plain", "\2secret-of-everything\nsecret-of-everything\n");
  seeds.add("address", "ipv4", "127.0.0.1:7878");
  seeds.add("address", "ipv6", "[::1]:80");
  seeds.add("address", "name", "hair.example");
  seeds.add("http_access", "name", "Hair.Example:7878\nhttps://hair.example:7878\n10.0.0.7\nhair.example");
  seeds.add("http_access", "page",
            "127.0.0.1:7878\n\n127.0.0.1\n\ngzip;q=0.5, *;q=0\nW/\"a\", \"b\"\n/?token=a");
  seeds.add("http_access", "ipv6", "[::1]:7878\nhttp://[::1]:7878\n::1\n\n");
  seeds.add("proxy", "ipv4", "10.0.0.0/8\n198.51.100.1, 203.0.113.9:4711, 10.0.0.1\n" + test::proxy_v4(9));
  seeds.add("proxy", "ipv6",
            "fd00::/8\n[2001:db8::7]:4711, fd00::1\n" +
                test::proxy_header(0x21, 0x21, std::string(36, '\x20') + test::bytes_of({2, 0, 1, 'a'})));
  seeds.add("proxy", "local", "10.0.0.7\n10.0.0.7\n" + test::proxy_header(0x20, 0, {}));
}

void add_recordings(const SeedFolder& seeds) {
  const Bytes moving = test::without_schemas(test::moving_recording(12));
  seeds.add("recording", "moving", moving);
  seeds.add("recording", "cut",
            Bytes(moving.begin(), moving.begin() + static_cast<ptrdiff_t>(moving.size() / 2)));
  seeds.add("recording", "every_kind", test::without_schemas(test::sample_recording()));
}

}  // namespace

void add_file_seeds(const SeedFolder& seeds) {
  add_grooms(seeds);
  add_curves(seeds);
  add_alembic(seeds);
  add_usdc(seeds);
  add_texts(seeds);
  add_recordings(seeds);
}

}  // namespace strandcast
