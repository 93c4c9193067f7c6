// Bytes that no honest peer sends: every truncation, random damage, bombs and limits, for every kind of
// message. All of it also runs through the fuzz entries, which check what comes out when something decodes.
#include <zstd.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>

#include "common/pictures/image_codec.h"
#include "common/strands/asset/head.h"
#include "common/strands/asset/lattice.h"
#include "common/strands/asset/layout.h"
#include "common/strands/byte_io.h"
#include "common/strands/head/head_form.h"
#include "common/strands/strand_payload.h"
#include "common/strands/tangent/symbols.h"
#include "common/strands/zstd_block.h"
#include "common/wire/messages.h"
#include "tests/fuzz/fuzz_targets.h"
#include "tests/fuzz/strand_chain.h"
#include "tests/support/hair_motion.h"
#include "tests/support/sample_asset.h"
#include "tests/support/sample_messages.h"

namespace strandcast::wire_bad_test {
namespace {

using namespace tangent;

using Bytes = std::vector<std::byte>;
using Entry = int (*)(const uint8_t*, size_t);

void feed(Entry entry, const Bytes& bytes) {
  EXPECT_EQ(entry(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()), 0);
}

/// Calls visit with copies of `good`: some bytes changed, a part repeated, a part missing.
template <class Visit>
void for_each_damage(const Bytes& good, int trials, uint32_t seed, Visit visit) {
  std::mt19937 random(seed);
  for (int trial = 0; trial < trials; ++trial) {
    Bytes bad = good;
    for (uint32_t flips = 1 + random() % 4; flips > 0; --flips)
      bad[random() % bad.size()] ^= static_cast<std::byte>(1 + random() % 255);
    if (trial % 5 == 3) {
      const auto from = static_cast<std::ptrdiff_t>(random() % bad.size());
      bad.erase(bad.begin() + from,
                bad.begin() + from + static_cast<std::ptrdiff_t>(random() % (bad.size() - from)));
    }
    if (trial % 5 == 4)
      bad.insert(bad.begin() + static_cast<std::ptrdiff_t>(random() % bad.size()), 8, std::byte{0xff});
    visit(bad);
  }
}

Bytes random_bytes(size_t size, std::mt19937& random) {
  Bytes bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

// ---- control messages ----

std::vector<Bytes> control_samples() {
  std::vector<Bytes> samples;
  for (const auto& message : sample_client_messages()) samples.push_back(encode(message));
  for (const auto& message : sample_server_messages()) samples.push_back(encode(message));
  return samples;
}

/// To both directions: what is good for one is strange to the other. The targets CHECK what they decode.
void feed_control(const Bytes& bytes) {
  feed(fuzz_client_message, bytes);
  feed(fuzz_server_message, bytes);
}

/// Whether it is a message of either direction; if not, both say in a sentence of what kind the fault is.
bool is_message(const Bytes& bytes) {
  const auto is_told = [](const Error& error) {
    return !error.message.empty() &&
           (error.code == ErrorCode::BadInput || error.code == ErrorCode::Unsupported ||
            error.code == ErrorCode::LimitExceeded);
  };
  const auto from_client = decode_client_message(bytes);
  const auto from_server = decode_server_message(bytes);
  EXPECT_TRUE(from_client || is_told(from_client.error())) << from_client.error().to_string();
  EXPECT_TRUE(from_server || is_told(from_server.error())) << from_server.error().to_string();
  return from_client || from_server;
}

TEST(ControlBytes, OfTruncatedDamagedAndRandomMessagesSomeAreRefusedAndTheOthersAreMessages) {
  size_t damaged = 0, refused = 0;
  const auto see = [&](const Bytes& bytes) {
    feed_control(bytes);
    ++damaged;
    refused += is_message(bytes) ? 0 : 1;
  };
  for (const Bytes& good : control_samples()) {
    ASSERT_TRUE(is_message(good));
    for (size_t size = 0; size < good.size(); ++size)
      see(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)));
    for_each_damage(good, 500, 7, see);
  }
  // Most damage breaks the framing, and some only changes a number.
  EXPECT_GT(refused, damaged / 4);
  EXPECT_LT(refused, damaged);
  std::mt19937 random(2);
  for (int i = 0; i < 3000; ++i) {
    Bytes bytes = random_bytes(1 + random() % 200, random);
    bytes[0] = std::byte{1};
    see(bytes);
  }
}

TEST(ControlBytes, OtherOpcodesAndNothingAreRefused) {
  EXPECT_EQ(decode_client_message({}).error().code, ErrorCode::BadInput);
  for (int opcode = 0; opcode < 256; ++opcode) {
    Bytes bytes = encode(ClientMessage(Ping{5}));
    bytes[0] = static_cast<std::byte>(opcode);
    EXPECT_EQ(decode_client_message(bytes).ok(), opcode == 1) << opcode;
  }
  const Bytes empty = {std::byte{1}};
  EXPECT_EQ(decode_client_message(empty).error().code, ErrorCode::BadInput);
  EXPECT_EQ(decode_server_message(empty).error().code, ErrorCode::BadInput);
}

// A later version of the same protocol may have sent it: whoever gets it goes on (WIRE.md, section 10).
TEST(ControlBytes, AnUnknownKindIsToldFromABrokenMessage) {
  const Bytes newer = {std::byte{0x01}, std::byte{0xc2}, std::byte{0x3e}, std::byte{0x01},
                       std::byte{0x78}};  // field 1000, one byte
  EXPECT_EQ(decode_client_message(newer).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(decode_server_message(newer).error().code, ErrorCode::Unsupported);
  Bytes cut = newer;
  cut.pop_back();
  EXPECT_EQ(decode_client_message(cut).error().code, ErrorCode::BadInput);
  EXPECT_EQ(decode_server_message(cut).error().code, ErrorCode::BadInput);
}

/// Appends an unknown protobuf field of exactly `size` bytes.
void append_unknown_field(Bytes& bytes, size_t size) {
  constexpr uint32_t kTag = 2000 << 3 | 2;  // field 2000, length-delimited; two bytes of tag
  std::vector<uint8_t> field = {(kTag & 0x7f) | 0x80, ((kTag >> 7) & 0x7f) | 0x80, kTag >> 14};
  const size_t length = size - 6;  // three bytes of length
  field.push_back(static_cast<uint8_t>((length & 0x7f) | 0x80));
  field.push_back(static_cast<uint8_t>(((length >> 7) & 0x7f) | 0x80));
  field.push_back(static_cast<uint8_t>(length >> 14));
  for (const uint8_t byte : field) bytes.push_back(static_cast<std::byte>(byte));
  bytes.resize(bytes.size() + length);
}

TEST(ControlBytes, ExactlyTheLimitPassesAndOneByteMoreFails) {
  const Bytes good = encode(ClientMessage(Ping{5}));
  Bytes longest = good;
  append_unknown_field(longest, kMaxControlBytes - good.size());
  ASSERT_EQ(longest.size(), kMaxControlBytes);
  const auto passed = decode_client_message(longest);
  ASSERT_TRUE(passed) << passed.error().to_string();
  EXPECT_EQ(std::get<Ping>(*passed).client_time_ns, 5);
  Bytes too_long = good;
  append_unknown_field(too_long, kMaxControlBytes + 1 - good.size());
  ASSERT_EQ(too_long.size(), kMaxControlBytes + 1);
  EXPECT_EQ(decode_client_message(too_long).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(decode_server_message(Bytes(1 << 20, std::byte{1})).error().code, ErrorCode::LimitExceeded);
}

Bytes control_of(std::initializer_list<int> protobuf) {
  Bytes bytes = {std::byte{1}};
  for (const int byte : protobuf) bytes.push_back(static_cast<std::byte>(byte));
  return bytes;
}

TEST(ControlBytes, UnknownEnumValuesAreNamed) {
  // hello (field 1) { role (field 1) = 9 }
  const auto role = decode_client_message(control_of({0x0a, 0x02, 0x08, 0x09}));
  ASSERT_FALSE(role);
  EXPECT_EQ(role.error().place, "hello.role");
  // hello { mode (field 2) = 3 }
  EXPECT_EQ(decode_client_message(control_of({0x0a, 0x02, 0x10, 0x03})).error().place, "hello.mode");
  // command (field 8) { }: nothing is asked for
  EXPECT_EQ(decode_client_message(control_of({0x42, 0x00})).error().place, "command");
  // command { command = 5 }
  EXPECT_EQ(decode_client_message(control_of({0x42, 0x02, 0x08, 0x05})).error().place, "command");
  // viewer_report (field 10) { device (field 5) = 4 }
  EXPECT_EQ(decode_client_message(control_of({0x52, 0x02, 0x28, 0x04})).error().place,
            "viewer_report.device");
  // mode_request (field 11) { mode = 3 }
  EXPECT_EQ(decode_client_message(control_of({0x5a, 0x02, 0x08, 0x03})).error().place, "mode_request.mode");
  // mode_change (field 9) { mode = 3 }
  EXPECT_EQ(decode_server_message(control_of({0x4a, 0x02, 0x08, 0x03})).error().place, "mode_change.mode");
  // hello { role = -1 }, as ten bytes of varint
  EXPECT_FALSE(decode_client_message(
      control_of({0x0a, 0x0b, 0x08, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01})));
}

// The eight bytes of hello (field 1) { step_ns (field 10) }, the highest last.
TEST(ControlBytes, NumbersOfPredictingThatAreNoneAreNamed) {
  const auto hello_with = [](int high, int next) {
    return control_of({0x0a, 0x09, 0x51, 0, 0, 0, 0, 0, 0, next, high});
  };
  EXPECT_EQ(std::get<Hello>(decode_client_message(hello_with(0x40, 0x29)).value()).step_ns, 12.5);
  EXPECT_EQ(decode_client_message(hello_with(0x7f, 0xf8)).error().place, "hello.step_ns") << "no number";
  EXPECT_EQ(decode_client_message(hello_with(0x7f, 0xf0)).error().place, "hello.step_ns") << "infinite";
  EXPECT_EQ(decode_client_message(hello_with(0xc0, 0x29)).error().place, "hello.step_ns") << "negative";
  // hello { codec_wish (field 11) = "a\nb" }
  EXPECT_EQ(decode_client_message(control_of({0x0a, 0x05, 0x5a, 0x03, 'a', '\n', 'b'})).error().place,
            "hello.codec_wish");
}

TEST(ControlBytes, DeepNestingIsRefused) {
  // Groups of an unknown field, opened only, or opened and closed again.
  for (const size_t depth : {size_t{8}, size_t{17}, size_t{10'000}}) {
    Bytes bytes = {std::byte{1}};
    bytes.insert(bytes.end(), depth, std::byte{0x7b});  // field 15, start of group
    EXPECT_FALSE(decode_client_message(bytes)) << depth;
    bytes.insert(bytes.end(), depth, std::byte{0x7c});
    EXPECT_FALSE(decode_client_message(bytes)) << depth;
  }
  Bytes too_deep = encode(ClientMessage(Ping{5}));
  too_deep.insert(too_deep.end(), 10'000, std::byte{0x7b});
  too_deep.insert(too_deep.end(), 10'000, std::byte{0x7c});
  EXPECT_FALSE(decode_client_message(too_deep));
}

TEST(ControlBytes, TextThatIsNotUtf8IsRefused) {
  Bytes bytes = encode(ClientMessage(Hello{Role::Viewer, StreamMode::Strands, "abc", "", 0, 0}));
  constexpr std::array kName = {std::byte{'a'}, std::byte{'b'}, std::byte{'c'}};
  const auto name = std::search(bytes.begin(), bytes.end(), kName.begin(), kName.end());
  ASSERT_NE(name, bytes.end());
  *name = std::byte{0xff};
  EXPECT_FALSE(decode_client_message(bytes));
  *name = std::byte{'\n'};
  EXPECT_EQ(decode_client_message(bytes).error().place, "hello.name");
}

// ---- media headers ----

TEST(MediaHeaders, UnknownOpcodesAreToldTheKnownOnes) {
  Bytes message = make_encoded_frame({.opcode = Opcode::Asset, .sequence = 1}, {})->message;
  std::string known;
  std::string told;
  for (int opcode = 0; opcode < 256; ++opcode) {
    message[0] = static_cast<std::byte>(opcode);
    const auto header = unpack_frame_header(message);
    if (header)
      known += fmt::format("{}0x{:02x}", known.empty() ? "" : ", ", opcode);
    else
      told = header.error().message;
  }
  EXPECT_EQ(told, fmt::format("unknown media opcode 0xff (known: {})", known));
}

// ---- strand messages ----

constexpr uint32_t kStrands = 5;  // as in the fuzz entries' first size
constexpr uint32_t kVertices = 4;

struct Stream {
  std::string codec;
  std::unique_ptr<StrandEncoder> encoder;
  std::unique_ptr<StrandDecoder> decoder;
  HairMotion hair{{kStrands, kVertices, MotionKind::Active}};

  explicit Stream(const std::string& name) : codec(name) {
    encoder = std::move(make_strand_encoder(name)).value();
    decoder = std::move(make_strand_decoder(name, {kStrands, kVertices})).value();
  }
  EncodedFramePtr next() {
    hair.step();
    return encoder->encode(hair.snapshot(lattice_step_m(codec, 1e-4f).value()));
  }
};

/// The message with its payload length corrected to what it carries.
Bytes with_length(Bytes message) {
  const auto length = static_cast<uint32_t>(message.size() - kFrameHeaderBytes);
  std::memcpy(message.data() + 12, &length, sizeof(length));
  return message;
}

TEST(StrandBytes, EveryTruncationIsRefusedAndTheStreamGoesOn) {
  for (const StrandCodecInfo& codec : strand_codecs()) {
    Stream stream(codec.name);
    for (int i = 0; i < 3; ++i) {
      const auto frame = stream.next();
      for (size_t size = 0; size < frame->message.size(); ++size) {
        const Bytes cut(frame->message.begin(), frame->message.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_FALSE(stream.decoder->decode(cut)) << codec.name << " " << size;
        if (size < kFrameHeaderBytes) continue;
        EXPECT_FALSE(stream.decoder->decode(with_length(cut))) << codec.name << " " << size;
      }
      Bytes longer = frame->message;
      longer.push_back(std::byte{0});
      EXPECT_FALSE(stream.decoder->decode(with_length(longer)));
      EXPECT_TRUE(stream.decoder->decode(frame->message));
    }
  }
}

/// Input of a strand target: `honest_count` frames of its own chain, then one hostile message.
Bytes chain_input(int honest_count, ChainStep step, uint8_t flags, std::span<const std::byte> piece) {
  Bytes input = {std::byte{0}};  // its hair is kStrands x kVertices without a rest shape
  input.insert(input.end(), static_cast<size_t>(honest_count), static_cast<std::byte>(ChainStep::Honest));
  ByteWriter writer(input);
  writer.put(static_cast<uint8_t>(step));
  writer.put(flags);
  writer.put(static_cast<uint16_t>(piece.size()));
  writer.put_bytes(piece);
  return input;
}

TEST(StrandBytes, DamageGivesAnErrorOrAValidSnapshot) {
  const std::map<std::string, Entry> entries = {{"raw", fuzz_strand_raw},
                                                {"delta", fuzz_strand_delta},
                                                {"tangent", fuzz_strand_tangent},
                                                {"step", fuzz_strand_step}};
  for (const StrandCodecInfo& codec : strand_codecs()) {
    ASSERT_EQ(entries.count(codec.name), 1u) << "no fuzz target for " << codec.name;
    const Entry entry = entries.at(codec.name);
    Stream stream(codec.name);
    for (int i = 0; i < 4; ++i) {
      const auto frame = stream.next();
      for_each_damage(frame->message, 1000, 3, [&](const Bytes& bad) {
        for (const int honest_count : {0, 1})
          feed(entry, chain_input(honest_count, ChainStep::Whole, 0, bad));
      });
      // Behind a valid header, and behind a valid fixed part.
      for (const ChainStep step : {ChainStep::Payload, ChainStep::Body}) {
        const size_t skipped = kFrameHeaderBytes + (step == ChainStep::Body ? kStrandFixedBytes : 0);
        const Bytes rest(frame->message.begin() + static_cast<std::ptrdiff_t>(skipped), frame->message.end());
        for (const uint8_t flags : {uint8_t{0}, kAsKeyframe, kKnowsHash}) {
          for_each_damage(rest, 300, 5,
                          [&](const Bytes& bad) { feed(entry, chain_input(1, step, flags, bad)); });
        }
      }
    }
  }
}

TEST(StrandBytes, FixedPartIsCheckedFieldByField) {
  Stream stream("raw");
  const auto frame = stream.next();
  const auto with = [&](size_t offset, auto value) {
    Bytes bytes = frame->message;
    std::memcpy(bytes.data() + kFrameHeaderBytes + offset, &value, sizeof(value));
    return stream.decoder->decode(bytes);
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(with(0, uint8_t{9}));  // codec
  for (const float quantum_m : {0.0f, -1e-4f, kNan, INFINITY, 1.5f}) EXPECT_FALSE(with(4, quantum_m));
  EXPECT_FALSE(with(8, kStrands + 1));        // strand_count
  EXPECT_FALSE(with(12, ~0u));                // vertex_count
  EXPECT_FALSE(with(16, uint64_t{1} << 60));  // tick: no longer the announced state
  EXPECT_TRUE(with(24, int64_t{77}));         // motion_time is not part of the state
  for (const int64_t time_ns : {INT64_MIN, -kMaxStrandTimeNs - 1, kMaxStrandTimeNs + 1, INT64_MAX})
    EXPECT_FALSE(with(24, time_ns)) << time_ns;
  EXPECT_TRUE(with(24, kMaxStrandTimeNs));
  for (size_t axis = 0; axis < 3; ++axis) {
    for (const double position_m :
         {std::nan(""), HUGE_VAL, 2.0 * kMaxHeadPositionM, -2.0 * kMaxHeadPositionM})
      EXPECT_THAT(with(32 + 8 * axis, position_m).error().message, testing::HasSubstr("head of tick"));
  }
  for (size_t k = 0; k < 4; ++k) {
    for (const double part : {std::nan(""), HUGE_VAL, 2.0})
      EXPECT_THAT(with(56 + 8 * k, part).error().message, testing::HasSubstr("rotation"));
  }
  EXPECT_FALSE(with(88, uint64_t{0}));  // state hash
  EXPECT_FALSE(with(kStrandFixedBytes, kMaxLattice));
  EXPECT_TRUE(stream.decoder->decode(frame->message));
}

enum class ContentSize { Declared, Absent };

Bytes compressed(const Bytes& content, ContentSize mode) {
  Bytes packed(ZSTD_compressBound(content.size()));
  ZSTD_CCtx* context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, mode == ContentSize::Declared ? 1 : 0);
  packed.resize(ZSTD_compress2(context, packed.data(), packed.size(), content.data(), content.size()));
  ZSTD_freeCCtx(context);
  return packed;
}

TEST(ZstdBlocks, MustDeclareExactlyTheExpectedSize) {
  ZstdDecompressor zstd;
  const Bytes content(1000, std::byte{3});
  Bytes room(1000);
  const Bytes good = compressed(content, ContentSize::Declared);
  ASSERT_TRUE(zstd.fill(good, room));
  EXPECT_EQ(room, content);
  EXPECT_FALSE(zstd.fill(compressed(content, ContentSize::Absent), room));
  Bytes smaller(999), larger(1001);
  EXPECT_EQ(zstd.fill(good, smaller).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(zstd.fill(good, larger).error().code, ErrorCode::BadInput);
  Bytes twice = good;
  twice.insert(twice.end(), good.begin(), good.end());
  EXPECT_FALSE(zstd.fill(twice, room));
  EXPECT_FALSE(zstd.fill({}, room));
  // 64 MiB of zeros in a few kilobytes: refused by its declared size, before anything is unpacked.
  const Bytes bomb = compressed(Bytes(size_t{64} << 20), ContentSize::Declared);
  EXPECT_LT(bomb.size(), 20'000u);
  EXPECT_EQ(zstd.fill(bomb, room).error().code, ErrorCode::LimitExceeded);
}

TEST(StrandBytes, BombsInsideAValidMessageAreRefused) {
  Stream stream("delta");
  const auto key = stream.next();
  ASSERT_TRUE(stream.decoder->decode(key->message));
  const auto delta = stream.next();
  for (const ContentSize mode : {ContentSize::Declared, ContentSize::Absent}) {
    const Bytes bomb = compressed(Bytes(size_t{16} << 20), mode);
    for (const auto& good : {key, delta}) {
      const size_t weights = good == delta ? 90 : 0;
      Bytes message(good->message.begin(),
                    good->message.begin() +
                        static_cast<std::ptrdiff_t>(kFrameHeaderBytes + kStrandFixedBytes + weights));
      ByteWriter writer(message);
      writer.put(static_cast<uint32_t>(bomb.size()));
      writer.put_bytes(bomb);
      EXPECT_FALSE(stream.decoder->decode(with_length(message)));
    }
  }
  EXPECT_TRUE(stream.decoder->decode(delta->message));
}

TEST(StrandBytes, BombsInPlaceOfSymbolTablesAreRefused) {
  Stream stream("tangent");
  const auto key = stream.next();
  constexpr size_t kTablesAt = kFrameHeaderBytes + kStrandFixedBytes;
  const size_t weight_bytes = 2 * sizeof(ShapeWeights);
  for (const ContentSize mode : {ContentSize::Declared, ContentSize::Absent}) {
    const Bytes bomb = compressed(Bytes(size_t{16} << 20), mode);
    Bytes message(key->message.begin(), key->message.begin() + kTablesAt);
    ByteWriter writer(message);
    writer.put(static_cast<uint32_t>(bomb.size()));
    writer.put_bytes(bomb);
    message.resize(message.size() + weight_bytes);
    const auto decoded = stream.decoder->decode(with_length(message));
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().place, "symbol tables");
  }
  // Tables that do not rise would make a share of nothing or less. Shares of falling ones wrap around.
  Bytes falling(sizeof(Tables));
  for (size_t i = 0; i < falling.size() / sizeof(int16_t); ++i) {
    const auto start = static_cast<int16_t>(-static_cast<int>(i % kSymbolCount));
    std::memcpy(falling.data() + i * sizeof start, &start, sizeof start);
  }
  for (const Bytes& tables : {Bytes(sizeof(Tables)), falling}) {
    const Bytes content = compressed(tables, ContentSize::Declared);
    Bytes message(key->message.begin(), key->message.begin() + kTablesAt);
    ByteWriter writer(message);
    writer.put(static_cast<uint32_t>(content.size()));
    writer.put_bytes(content);
    message.resize(message.size() + weight_bytes);
    const auto decoded = stream.decoder->decode(with_length(message));
    ASSERT_FALSE(decoded);
    EXPECT_THAT(decoded.error().message, testing::HasSubstr("does not rise"));
  }
  EXPECT_TRUE(stream.decoder->decode(key->message));
}

// Before anything is decoded with it: a hostile server could announce the hash of what would come out.
TEST(StrandBytes, UnknownFlagsAndLengthsBeyondTheLastOneAreRefused) {
  Stream stream("tangent");
  ASSERT_TRUE(stream.decoder->decode(stream.next()->message));
  const auto delta = stream.next();
  constexpr size_t kFlagsAt = kFrameHeaderBytes + kStrandFixedBytes;
  constexpr size_t kBlendAt = kFlagsAt + 1;
  for (const int blend : {kMaxLengthBlend + 1, 255}) {
    Bytes message = delta->message;
    message[kBlendAt] = static_cast<std::byte>(blend);
    const auto decoded = stream.decoder->decode(message);
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().code, ErrorCode::BadInput);
    EXPECT_EQ(decoded.error().message,
              fmt::format("strand payload blends lengths by {}/16, at most 16 are possible", blend));
  }
  Bytes message = delta->message;
  message[kFlagsAt] = std::byte{2};
  EXPECT_EQ(stream.decoder->decode(message).error().message, "strand payload has flags 2, known is 1");
  EXPECT_TRUE(stream.decoder->decode(delta->message)) << "the stream goes on";
}

// ---- assets and pictures ----

TEST(AssetBytes, TruncatedDamagedAndRandomAssetsNeverCrash) {
  for (const AssetLayout layout : {AssetLayout::Floats, AssetLayout::Numbers}) {
    const Bytes good = encode_scene_asset(sample_asset(20, 5), layout);
    for (size_t size = 0; size < good.size(); ++size)
      EXPECT_FALSE(decode_scene_asset(std::span(good).first(size))) << size;
    Bytes longer = good;
    longer.push_back(std::byte{0});
    EXPECT_FALSE(decode_scene_asset(longer));
    for_each_damage(good, 5000, 11, [](const Bytes& bad) { feed(fuzz_scene_asset, bad); });
  }
  SceneAsset built_in = sample_asset(4, 2);
  round_to_lattice(built_in.rest_position_m, kRestStepBits);
  built_in.head = as_sent(make_head(HeadForm()));
  const Bytes form = encode_scene_asset(built_in);
  EXPECT_LT(form.size(), 500u);
  for (size_t size = 0; size < form.size(); ++size)
    EXPECT_FALSE(decode_scene_asset(std::span(form).first(size))) << size;
  for_each_damage(form, 100, 12,
                  [](const Bytes& bad) { feed(fuzz_scene_asset, bad); });  // making heads takes long
  std::mt19937 random(4);
  for (int i = 0; i < 1000; ++i) feed(fuzz_scene_asset, random_bytes(random() % 300, random));
}

TEST(AssetBytes, AnAssetThatUnpacksToLessThanItDeclaresIsRefused) {
  SceneAsset asset = sample_asset(20, 5);
  Bytes payload = encode_scene_asset(asset, AssetLayout::Floats);
  payload.resize(24);  // keep the counts
  const Bytes wrong = compressed(Bytes(100), ContentSize::Declared);
  payload.insert(payload.end(), wrong.begin(), wrong.end());
  EXPECT_FALSE(decode_scene_asset(payload));
  payload.resize(24);
  const Bytes absent = compressed(Bytes(5000), ContentSize::Absent);
  payload.insert(payload.end(), absent.begin(), absent.end());
  EXPECT_EQ(decode_scene_asset(payload).error().code, ErrorCode::BadInput);
}

TEST(PictureBytes, DamagedJpegsNeverCrash) {
  Image image{40, 30, std::vector<uint8_t>(40 * 30 * 4, 200)};
  for (size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = static_cast<uint8_t>(i * i >> 6);
  const auto good = encode_jpeg(image, 70);
  ASSERT_TRUE(good);
  for_each_damage(*good, 3000, 13, [](const Bytes& bad) { feed(fuzz_jpeg, bad); });
}

}  // namespace
}  // namespace strandcast::wire_bad_test
