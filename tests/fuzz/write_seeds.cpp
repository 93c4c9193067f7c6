// Writes the first inputs of the fuzzers whose format has structure: fuzz_seeds FOLDER makes
// FOLDER/<target>/seed_*. What fuzzing finds beside them is committed in the same folders.
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/pictures/image_codec.h"
#include "common/pictures/jpeg_tiles.h"
#include "common/pictures/picture.h"
#include "common/pictures/video_codec.h"
#include "common/scene/scene_file.h"
#include "common/strands/residual_coder.h"
#include "common/strands/strand_payload.h"
#include "common/strands/value_coder.h"
#include "tests/fuzz/picture_chain.h"
#include "tests/fuzz/strand_chain.h"
#include "tests/support/hair_motion.h"
#include "tests/support/live_packets.h"
#include "tests/support/proxy_header.h"
#include "tests/support/sample_asset.h"
#include "tests/support/sample_messages.h"
#include "tests/support/sample_recording.h"
#include "tests/support/test_pictures.h"

namespace strandcast {
namespace {

using Bytes = std::vector<std::byte>;

Bytes bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// Numbers one behind the other.
template <class... Numbers>
Bytes packed(Numbers... numbers) {
  Bytes bytes((sizeof(Numbers) + ...));
  size_t at = 0;
  const auto put = [&](auto number) {
    std::memcpy(bytes.data() + at, &number, sizeof(number));
    at += sizeof(number);
  };
  (put(numbers), ...);
  return bytes;
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes bytes;
  for (const Bytes& part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}

class SeedFolder {
 public:
  explicit SeedFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void add(const std::string& target, const std::string& name, const Bytes& bytes) const {
    std::filesystem::create_directories(folder_ / target);
    CHECK(save_file(folder_ / target / ("seed_" + name), bytes).ok());
  }
  void add(const std::string& target, const std::string& name, std::string_view text) const {
    add(target, name, bytes_of(text));
  }

 private:
  std::filesystem::path folder_;
};

/// Steps of live_policy_fuzz: poses of a head that moves along x, a period apart each.
void add_live_poses(const SeedFolder& seeds) {
  constexpr uint8_t kTake = 3, kNumbered = 4, kTimed = 16, kAnyNumbers = 1;
  constexpr uint16_t kPeriod = 500;  // in 20 microseconds: 10 ms
  constexpr int16_t kOne = 1 << 13;
  const auto pose = [](int i, double x_m) {
    return packed(kPeriod, kTake, static_cast<uint8_t>(kNumbered | kTimed), static_cast<int16_t>(kOne * x_m),
                  int16_t{kOne}, int16_t{0}, kOne, int16_t{0}, int16_t{0}, int16_t{0},
                  static_cast<uint8_t>(i), static_cast<uint16_t>(10 * i));
  };
  const auto command = [](uint8_t step) { return packed(kPeriod, step); };
  Bytes order, jump, commands, numbers;
  for (int i = 0; i < 60; ++i) {
    const int sent = i % 10 == 4 ? i + 1 : i % 10 == 5 ? i - 1 : i;  // two change places
    if (i % 10 != 8) order = joined({order, pose(sent, 0.01 * sent)});
    jump = joined({jump, pose(i, i >= 20 && i < 40 ? 2.0 : 0.0)});
    commands =
        joined({commands, pose(i, 0.01 * i), i % 20 == 7 ? command(static_cast<uint8_t>(i / 20)) : Bytes{}});
  }
  for (const double number :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e308})
    numbers = joined({numbers, pose(0, 0.0),
                      packed(kPeriod, kTake, kAnyNumbers, number, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
                      packed(kPeriod, kTake, kAnyNumbers, 0.0, 0.0, 0.0, number, 0.0, 0.0, 0.0)});
  seeds.add("live_policy", "order", order);
  seeds.add("live_policy", "jump", jump);
  seeds.add("live_policy", "commands", commands);
  seeds.add("live_policy", "numbers", numbers);
}

void add_messages(const SeedFolder& seeds) {
  int i = 0;
  for (const ClientMessage& message : sample_client_messages())
    seeds.add("client_message", fmt::format("{}", i++), encode(message));
  i = 0;
  for (const ServerMessage& message : sample_server_messages())
    seeds.add("server_message", fmt::format("{}", i++), encode(message));
  LookChange dark{sample_look(), sample_camera()};
  dark.look.light_direction = glm::vec3(0.0f);
  seeds.add("server_message", "light_of_no_length", encode(ServerMessage(dark)));
  FrameHeader header;
  header.opcode = Opcode::StrandKeyframe;
  header.sequence = 1;
  seeds.add("frame_header", "keyframe", make_encoded_frame(header, packed(uint32_t{5}))->message);
}

void add_blocks(const SeedFolder& seeds) {
  Bytes asset = encode_scene_asset(sample_asset(5, 3));
  seeds.add("scene_asset", "head", asset);
  SceneAsset bare = sample_asset(1, 2);
  bare.head = {};
  seeds.add("scene_asset", "bare", encode_scene_asset(bare));

  Image image{16, 9, std::vector<uint8_t>(16 * 9 * 4, 200)};
  for (size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = static_cast<uint8_t>(i * i >> 4);
  seeds.add("jpeg", "small", encode_jpeg(image, 70).value());

  Bytes block;
  ZstdCompressor().append(bytes_of("strands and strands and strands"), 3, block);
  seeds.add("zstd_block", "text", joined({packed(uint16_t{31}), block}));
  Bytes planes;
  PlaneEncoder().append(std::vector<int32_t>{0, 1, -1, 300, -70'000}, 1, planes);
  seeds.add("zstd_block", "planes", joined({packed(uint16_t{20}), planes}));

  ValueWriter writer;
  SymbolTable table;
  for (uint32_t k = 0; k < kSymbolCount; ++k)
    table.start[k] = static_cast<int16_t>(k * (kProbabilityOne / static_cast<int32_t>(kSymbolCount)));
  for (const int32_t value : {0, 1, -3, 40, 1'000, -70'000}) writer.put(fold_sign(value), table, 2);
  Bytes slice;
  writer.finish(slice);
  seeds.add("value_coder", "slice", joined({packed(uint8_t{6}), slice}));
}

Bytes chain_step(ChainStep step, uint8_t flags, const Bytes& piece) {
  return joined({packed(static_cast<uint8_t>(step), flags, static_cast<uint16_t>(piece.size())), piece});
}

/// Honest frames with each kind of hostile message between them.
void add_chains(const SeedFolder& seeds) {
  constexpr int kHairSizes = 4;
  constexpr uint16_t kBodyAt = kFrameHeaderBytes + kStrandFixedBytes;
  const Bytes honest = packed(static_cast<uint8_t>(ChainStep::Honest));
  const Bytes body_patch =
      packed(static_cast<uint16_t>(kBodyAt + 20), uint8_t{1}, uint16_t{500}, uint8_t{64});
  const Bytes fixed_patch = packed(static_cast<uint16_t>(kFrameHeaderBytes + 4), uint8_t{1});
  for (const StrandCodecInfo& codec : strand_codecs()) {
    auto encoder = make_strand_encoder(codec.name).value();
    HairMotion hair({5, 4, MotionKind::Active});
    hair.step();
    const EncodedFramePtr frame = encoder->encode(hair.snapshot(lattice_step_m(codec.name, 1e-4f).value()));
    const Bytes body(frame->message.begin() + kBodyAt, frame->message.end());
    for (int settings = 0; settings < 2 * kHairSizes; ++settings) {
      const Bytes begin = packed(static_cast<uint8_t>(settings));
      const Bytes patched = joined({begin, honest, chain_step(ChainStep::Patched, kKnowsHash, body_patch),
                                    honest, honest, chain_step(ChainStep::Patched, 0, fixed_patch), honest});
      const Bytes spliced = joined(
          {begin, honest, honest,
           chain_step(ChainStep::Spliced, kFixLength | kKnowsHash, packed(kBodyAt, uint64_t{0})), honest});
      const std::string name = codec.name + fmt::format("_{}", settings);
      seeds.add("strand_" + codec.name, "patched_" + name, patched);
      seeds.add("strand_" + codec.name, "spliced_" + name, spliced);
    }
    // What stands before the integers: of "step" a state, ticks, a scene or a model.
    Bytes head_patches;
    for (uint16_t at = 2; at < 40; at += 5)
      head_patches = joined({head_patches, honest,
                             chain_step(ChainStep::Patched, kKnowsHash | kFixLength,
                                        packed(static_cast<uint16_t>(kBodyAt + at), uint8_t{64}))});
    for (int settings = 1; codec.name == "step" && settings < 2 * kHairSizes; settings += 2)
      seeds.add("strand_" + codec.name, fmt::format("head_{}", settings),
                joined({packed(static_cast<uint8_t>(settings)), head_patches, honest}));
    const Bytes made_up = joined({packed(uint8_t{0}), chain_step(ChainStep::Whole, 0, frame->message), honest,
                                  chain_step(ChainStep::Body, kAsKeyframe | kKnowsHash, body),
                                  chain_step(ChainStep::Body, kKnowsHash, body),
                                  chain_step(ChainStep::Payload, 0, body), honest});
    seeds.add("strand_" + codec.name, "made_up", made_up);
  }
}

Bytes picture_step(PictureStep step, uint8_t flags) {
  return packed(static_cast<uint8_t>(step), flags);
}
Bytes picture_step(PictureStep step, uint8_t flags, const Bytes& piece) {
  return joined({picture_step(step, flags), packed(static_cast<uint16_t>(piece.size())), piece});
}

/// Two payloads of a codec: a whole picture, and a change of it.
struct PicturePair {
  Bytes whole, change;
};

PicturePair make_pictures(PictureCodec codec) {
  constexpr uint32_t kWidth = 70, kHeight = 20;
  const Image first = test::waving_lines(kWidth, kHeight, 0.0);
  const Image second = test::waving_lines(kWidth, kHeight, 0.3);
  if (codec == PictureCodec::Jpeg) return {encode_jpeg(first, 30).value(), encode_jpeg(second, 95).value()};
  if (codec == PictureCodec::JpegTiles) {
    auto encoder = TileEncoder::make().value();
    const CodedTile left = encoder.encode(first, 0, 30, TileChroma::Halved).value();
    const CodedTile right = encoder.encode(first, 1, 95, TileChroma::Full).value();
    const PlacedTile all[] = {{0, &left}, {1, &right}};
    return {pack_tiles(kWidth, kHeight, all), pack_tiles(kWidth, kHeight, std::span(all).last(1))};
  }
  const auto encoder = make_video_encoder(codec, {kWidth, kHeight, 30.0, 2e5}).value();
  const auto code = [&](const Image& image) {
    return encoder->encode(image, VideoFrame::Delta, VideoRate::Target).value();
  };
  const Bytes whole = code(first);
  return {whole, code(second)};
}

/// For each codec: honest pictures with lost and damaged ones between them, and real payloads in other
/// places.
void add_pictures(const SeedFolder& seeds) {
  const Bytes honest = picture_step(PictureStep::Honest, 0);
  const Bytes lost = picture_step(PictureStep::Lost, 0);
  for (const PictureCodec codec : kPictureCodecs) {
    if ((encodable_picture_codecs() & codec_bit(codec)) == 0) continue;
    const auto index = static_cast<uint8_t>(codec);
    const std::string name = to_string(codec);
    const PicturePair pair = make_pictures(codec);
    const auto payload = [&](uint8_t flags, const Bytes& bytes) {
      return picture_step(PictureStep::Payload, static_cast<uint8_t>(flags | index << kOpcodeShift), bytes);
    };
    const Bytes cut(pair.whole.begin(), pair.whole.begin() + static_cast<ptrdiff_t>(pair.whole.size() / 2));
    Bytes wrong = pair.whole;
    for (size_t i = 12; i < wrong.size(); i += 40) wrong[i] ^= std::byte{0x41};
    for (uint8_t size = 0; size < kPictureSizes; ++size) {
      const Bytes chain =
          picture_step(PictureStep::Other, static_cast<uint8_t>(index * kPictureSizes + size));
      const Bytes patch = packed(uint16_t{kFrameHeaderBytes + 1}, uint8_t{3},
                                 uint16_t{kFrameHeaderBytes + 30}, uint8_t{0x55});
      const Bytes splice = joined({packed(uint16_t{kFrameHeaderBytes + 20}), cut});
      seeds.add(
          "picture_chain", fmt::format("damaged_{}_{}", name, size),
          joined({chain, honest, honest, picture_step(PictureStep::Patched, kThenDelta, patch), honest, lost,
                  honest, honest, picture_step(PictureStep::Spliced, kFixPayload | kThenDelta, splice),
                  honest, lost, lost, honest}));
    }
    seeds.add(
        "picture_chain", "payloads_" + name,
        joined({honest, payload(kAsWhole, pair.whole), payload(0, pair.change), honest,
                payload(kAsWhole | kThenDelta, pair.change), payload(kAsWhole, cut), payload(0, pair.change),
                payload(kAsWhole, wrong), payload(kAsWhole, pair.whole), honest}));
    // Under the header of another codec.
    seeds.add("picture_chain", "mistaken_" + name,
              picture_step(PictureStep::Payload,
                           static_cast<uint8_t>(kAsWhole | (index + 1) % 3 << kOpcodeShift), pair.whole));
    FrameHeader header;
    header.opcode = Opcode::Vp8Frame;
    header.sequence = 7;
    seeds.add(
        "picture_chain", "message_" + name,
        joined({picture_step(PictureStep::Whole, kThenDelta, make_encoded_frame(header, pair.whole)->message),
                honest}));
  }
}

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

/// Pieces as FuzzInput::take_piece has them.
Bytes pieces(std::initializer_list<Bytes> parts) {
  Bytes bytes;
  for (const Bytes& part : parts) bytes = joined({bytes, packed(static_cast<uint16_t>(part.size())), part});
  return bytes;
}

/// OSC that is right, and each kind of it that other readers are known to have broken on.
void add_live_osc(const SeedFolder& seeds) {
  using test::osc;
  using test::osc_bundle;
  const auto add = [&](const std::string& name, std::initializer_list<Bytes> datagrams) {
    seeds.add("live_osc", name, joined({packed(uint8_t{1}), pieces(datagrams)}));
  };
  const test::Quad turned = {0.1f, 0.2f, -0.3f, 0.9f};
  const Bytes head = test::vmc_head({0.1f, 1.5f, -0.2f}, turned, 1.5f);
  add("head", {head, test::vmc_head({0.2f, 1.5f, 0.1f}, {0, 0, 0, 1}, 1.6f), test::osc_wind({1, 2, 3})});
  std::vector<Bytes> bones;
  for (const char* name : {"Hips", "Spine", "Chest", "Neck", "Head", "LeftShoulder", "LeftUpperArm",
                           "LeftLowerArm", "RightShoulder", "RightUpperArm", "RightLowerArm", "UpperChest"})
    bones.push_back(test::vmc_bone(name, {0, 0, 0}, turned));
  add("bones", {osc_bundle(bones), osc_bundle({bones.back()}), osc_bundle(bones)});
  add("single",
      {bones[4], bones[0], bones[4], test::vmc_pose("/VMC/Ext/Tra/Pos", "LHR-1", {1, 2, 3}, turned)});
  add("no_direction", {osc_bundle({test::vmc_bone("Head", {NAN, 0, 0}, {0, 0, 0, 0})})});
  add("nested", {osc_bundle({osc_bundle({osc_bundle({osc_bundle({osc("/a", {1})})})})}),
                 osc_bundle({osc_bundle({osc_bundle({osc_bundle({osc_bundle({osc("/a", {1})})})})})})});
  add("padding", {osc("/abc", {std::string("four"), 1}), osc("/abcd", {std::string("eightlet"), 2})});
  const auto blob = [&](uint32_t size) {
    return test::PacketWriter(std::endian::big)
        .text(std::string("/b\0\0,b\0\0", 8))
        .put(size)
        .put(uint32_t{0})
        .bytes();
  };
  add("blob", {blob(4), blob(9), blob(0xffffffff), blob(0xfffffffd)});
  add("mark_without_nul", {bytes_of("#bundle!\1\1\1\1\1\1\1\1"), bytes_of("#bundle"), bytes_of("#")});
  Bytes wrong_size = head;
  wrong_size[16] = std::byte{0x7f};
  add("size_beyond", {wrong_size, Bytes(head.begin(), head.begin() + 40)});
  add("unknown", {osc("/VMC/Ext/Bone/Pos", {std::string("Head"), 1.0f}), osc("/VMC/Ext/T", {3}),
                  test::PacketWriter(std::endian::big).text(std::string("/q\0\0,Qf\0", 8)).bytes()});
}

/// The other live protocols: right packets, cut ones, wrong checksums, counts beyond all bounds.
void add_live_packets(const SeedFolder& seeds) {
  enum Protocol : uint8_t { kOpentrack, kFreed, kNatnet, kVrpn, kFace };
  const auto add = [&](Protocol protocol, uint8_t settings, const std::string& name,
                       std::initializer_list<Bytes> packets) {
    seeds.add("live_packet", name,
              joined({packed(static_cast<uint8_t>(protocol), settings), pieces(packets)}));
  };
  const auto with = [](Bytes bytes, size_t at, uint8_t value) {
    bytes[at] = std::byte{value};
    return bytes;
  };
  const auto cut = [](const Bytes& bytes, size_t left) {
    return Bytes(bytes.begin(), bytes.end() - static_cast<ptrdiff_t>(left));
  };
  const Bytes places = test::opentrack({1, 2, 3, 40, 50, 60});
  add(kOpentrack, 0, "opentrack", {places, cut(places, 1), test::opentrack({NAN, 0, 0, 1e308, 0, 0})});
  const Bytes camera = test::freed({2, {10, 20, 30}, {100, 200, 300}});
  add(kFreed, 1, "freed", {camera, with(camera, 28, 0), with(camera, 0, 0xD0), cut(camera, 1)});
  for (const std::string version : {"3.1", "4.0", "4.1"}) {
    test::NatnetPacket frame;
    frame.version = version;
    frame.bodies = {{2, {1, 2, 3}, {0, 0, 0, 1}, true}, {3, {1, 2, 3}, {0, 0, 0, 0}, false}};
    frame.bones = {{7, {1, 2, 3}, {0, 0, 0, 1}, true}};
    frame.has_all_kinds = true;
    const Bytes motion = test::natnet(frame);
    const Bytes names = test::natnet_names(version, {{2, "Head"}}, {{7, "Head"}});
    add(kNatnet, 0, "natnet_" + version,
        {test::natnet_server(4, 1), names, motion, cut(motion, 1), cut(names, 3),
         test::natnet_message(8, {})});
    add(kNatnet, 6, "natnet_counts_" + version,
        {with(motion, 8, 0xff), with(motion, 11, 0xff), with(motion, 15, 0xff), with(names, 7, 0xff)});
  }
  const Bytes begin = test::vrpn_begin("Head");
  const Bytes pose = test::vrpn_pose(1.5, 0, 3, 1, {1, 2, 3}, {0, 0, 0, 1});
  add(kVrpn, 0, "vrpn", {begin, pose, joined({pose, cut(pose, 5)})});
  add(kVrpn, 64, "vrpn_cut",
      {joined({begin, pose, test::vrpn_message(1, 0, 2, Bytes(3)), pose}), with(pose, 0, 0xff)});
  add(kVrpn, 1, "vrpn_names",
      {joined({begin, test::vrpn_description(-1, 9999, "far")}),
       joined({begin, test::vrpn_message(0, 1, -2, Bytes(6, std::byte{0x7f}))})});
  const Bytes face = test::live_link_face({});
  add(kFace, 0, "face", {face, cut(face, 245), cut(face, 1), with(face, 0, 7), with(face, 1, 0xff)});
  add(kFace, 1, "face_sized",
      {test::PacketWriter(std::endian::big).put(static_cast<uint32_t>(face.size())).append(face).bytes()});
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
}  // namespace strandcast

int main(int argument_count, char** arguments) {
  using namespace strandcast;
  if (argument_count != 2) {
    fmt::print(stderr, "usage: fuzz_seeds FOLDER (for example tests/fuzz/corpus)\n");
    return 2;
  }
  const SeedFolder seeds(arguments[1]);
  add_messages(seeds);
  add_live_poses(seeds);
  add_blocks(seeds);
  add_chains(seeds);
  add_pictures(seeds);
  add_grooms(seeds);
  add_curves(seeds);
  add_live_osc(seeds);
  add_live_packets(seeds);
  add_texts(seeds);
  add_recordings(seeds);
  return 0;
}
