// First inputs for what travels between servers and viewers.
#include "common/pictures/image_codec.h"
#include "common/pictures/jpeg_tiles.h"
#include "common/pictures/picture.h"
#include "common/pictures/video_codec.h"
#include "common/strands/asset/head.h"
#include "common/strands/asset/lattice.h"
#include "common/strands/asset/layout.h"
#include "common/strands/head/head_form.h"
#include "common/strands/residual_coder.h"
#include "common/strands/strand_payload.h"
#include "common/strands/value_coder.h"
#include "tests/fuzz/picture_chain.h"
#include "tests/fuzz/seed_folder.h"
#include "tests/fuzz/strand_chain.h"
#include "tests/support/hair_motion.h"
#include "tests/support/sample_asset.h"
#include "tests/support/sample_messages.h"
#include "tests/support/test_pictures.h"

namespace strandcast {
namespace {

using Bytes = SeedBytes;

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
  seeds.add("scene_asset", "floats", encode_scene_asset(sample_asset(5, 3), AssetLayout::Floats));
  SceneAsset bare = sample_asset(1, 2);
  bare.head = {};
  seeds.add("scene_asset", "bare", encode_scene_asset(bare));
  round_to_lattice(bare.rest_position_m, kRestStepBits);
  bare.head = as_sent(make_head(HeadForm()));
  seeds.add("scene_asset", "form", encode_scene_asset(bare));

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
    // The last of the chain is exact: its head, and ticks.
    Bytes exact(7, honest[0]);
    for (uint16_t at = kFrameHeaderBytes + 9; codec.name == "step" && at < kFrameHeaderBytes + 17; ++at)
      exact = joined({exact, chain_step(ChainStep::Patched, kKnowsHash, packed(at, uint8_t{4}))});
    if (codec.name == "step") seeds.add("strand_step", "exact", joined({packed(uint8_t{1}), exact, honest}));
    const Bytes made_up = joined({packed(uint8_t{0}), chain_step(ChainStep::Whole, 0, frame->message), honest,
                                  chain_step(ChainStep::Body, kAsKeyframe | kKnowsHash, body),
                                  chain_step(ChainStep::Body, kKnowsHash, body),
                                  chain_step(ChainStep::Payload, 0, body), honest});
    seeds.add("strand_" + codec.name, "made_up", made_up);
  }
}

Bytes picture_step(PictureChainStep step, uint8_t flags) {
  return packed(static_cast<uint8_t>(step), flags);
}
Bytes picture_step(PictureChainStep step, uint8_t flags, const Bytes& piece) {
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
  const Bytes honest = picture_step(PictureChainStep::Honest, 0);
  const Bytes lost = picture_step(PictureChainStep::Lost, 0);
  for (const PictureCodec codec : kPictureCodecs) {
    if ((encodable_picture_codecs() & codec_bit(codec)) == 0) continue;
    const auto index = static_cast<uint8_t>(codec);
    const std::string name = to_string(codec);
    const PicturePair pair = make_pictures(codec);
    const auto payload = [&](uint8_t flags, const Bytes& bytes) {
      return picture_step(PictureChainStep::Payload, static_cast<uint8_t>(flags | index << kOpcodeShift),
                          bytes);
    };
    const Bytes cut(pair.whole.begin(), pair.whole.begin() + static_cast<ptrdiff_t>(pair.whole.size() / 2));
    Bytes wrong = pair.whole;
    for (size_t i = 12; i < wrong.size(); i += 40) wrong[i] ^= std::byte{0x41};
    for (uint8_t size = 0; size < kPictureSizes; ++size) {
      const Bytes chain =
          picture_step(PictureChainStep::Other, static_cast<uint8_t>(index * kPictureSizes + size));
      const Bytes patch = packed(uint16_t{kFrameHeaderBytes + 1}, uint8_t{3},
                                 uint16_t{kFrameHeaderBytes + 30}, uint8_t{0x55});
      const Bytes splice = joined({packed(uint16_t{kFrameHeaderBytes + 20}), cut});
      seeds.add("picture_chain", fmt::format("damaged_{}_{}", name, size),
                joined({chain, honest, honest, picture_step(PictureChainStep::Patched, kThenDelta, patch),
                        honest, lost, honest, honest,
                        picture_step(PictureChainStep::Spliced, kFixPayload | kThenDelta, splice), honest,
                        lost, lost, honest}));
    }
    seeds.add(
        "picture_chain", "payloads_" + name,
        joined({honest, payload(kAsWhole, pair.whole), payload(0, pair.change), honest,
                payload(kAsWhole | kThenDelta, pair.change), payload(kAsWhole, cut), payload(0, pair.change),
                payload(kAsWhole, wrong), payload(kAsWhole, pair.whole), honest}));
    // Under the header of another codec.
    seeds.add("picture_chain", "mistaken_" + name,
              picture_step(PictureChainStep::Payload,
                           static_cast<uint8_t>(kAsWhole | (index + 1) % 3 << kOpcodeShift), pair.whole));
    FrameHeader header;
    header.opcode = Opcode::Vp8Frame;
    header.sequence = 7;
    seeds.add("picture_chain", "message_" + name,
              joined({picture_step(PictureChainStep::Whole, kThenDelta,
                                   make_encoded_frame(header, pair.whole)->message),
                      honest}));
  }
}

}  // namespace

void add_wire_seeds(const SeedFolder& seeds) {
  add_messages(seeds);
  add_blocks(seeds);
  add_chains(seeds);
  add_pictures(seeds);
}

}  // namespace strandcast
