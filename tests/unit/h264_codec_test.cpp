#include "common/codec/h264_codec.h"

#include "common/codec/picture.h"
#include "common/codec/picture_decoder.h"
#include "tests/support/test_pictures.h"

namespace strandcast {
namespace {

using test::in_grey;
using test::psnr;
using test::waving_lines;
using Bytes = std::vector<std::byte>;
using Frame = H264Encoder::Frame;
using Rate = H264Encoder::Rate;

constexpr uint32_t kWidth = 160, kHeight = 90;

// ---- what is read before decoding, in every build ----

/// Sequence parameters in the order of ITU-T H.264, 7.3.2.1.1.
struct Sequence {
  uint32_t profile = 66;
  uint32_t colour_format = 1;  // of high profiles
  uint32_t references = 1;
  uint32_t columns = 40, rows = 23;
  uint32_t is_progressive = 1;
  uint32_t cut_right = 0, cut_below = 4;  // of colour samples
};

class BitWriter {
 public:
  void put(uint32_t value, int count) {
    for (int i = count - 1; i >= 0; --i) bits_.push_back((value >> i & 1u) != 0);
  }
  void put_number(uint32_t value) {
    int digits = 0;
    while ((uint64_t{value} + 1) >> (digits + 1) != 0) ++digits;
    put(0, digits);
    put(value + 1, digits + 1);
  }
  Bytes finish() {
    bits_.push_back(true);
    Bytes bytes((bits_.size() + 7) / 8);
    for (size_t i = 0; i < bits_.size(); ++i)
      if (bits_[i]) bytes[i / 8] |= std::byte{0x80} >> (i % 8);
    return bytes;
  }

 private:
  std::vector<bool> bits_;
};

Bytes unit(uint8_t kind, const Bytes& body = {std::byte{0x80}}) {
  Bytes bytes = {std::byte{0}, std::byte{0}, std::byte{1}, std::byte{kind}};
  size_t zeros = 0;
  for (const std::byte byte : body) {
    if (zeros >= 2 && byte <= std::byte{3}) {
      bytes.push_back(std::byte{3});
      zeros = 0;
    }
    zeros = byte == std::byte{0} ? zeros + 1 : 0;
    bytes.push_back(byte);
  }
  return bytes;
}

Bytes sequence_unit(const Sequence& sequence) {
  BitWriter bits;
  bits.put(sequence.profile, 8);
  bits.put(30, 16);
  bits.put_number(0);
  if (sequence.profile == 100) {
    bits.put_number(sequence.colour_format);
    bits.put_number(0);
    bits.put_number(0);
    bits.put(0, 2);
  }
  bits.put_number(0);
  bits.put_number(2);
  bits.put_number(sequence.references);
  bits.put(0, 1);
  bits.put_number(sequence.columns - 1);
  bits.put_number(sequence.rows - 1);
  bits.put(sequence.is_progressive, 1);
  bits.put(1, 1);
  bits.put(1, 1);
  for (const uint32_t cut : {0u, sequence.cut_right, 0u, sequence.cut_below}) bits.put_number(cut);
  bits.put(0, 1);
  return unit(0x67, bits.finish());
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes bytes;
  for (const Bytes& part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}

Bytes keyframe(const Sequence& sequence) {
  return joined({sequence_unit(sequence), unit(0x68), unit(0x65)});
}

ErrorCode refusal(const Bytes& frame) {
  const auto info = read_h264_info(frame);
  EXPECT_FALSE(info.ok());
  return info ? ErrorCode::Internal : info.error().code;
}

TEST(H264Header, TellsTheSizeOfAKeyframe) {
  for (const uint32_t profile : {66u, 100u}) {
    Sequence sequence;
    sequence.profile = profile;
    const auto info = read_h264_info(keyframe(sequence));
    ASSERT_TRUE(info) << info.error().to_string();
    EXPECT_TRUE(info->is_keyframe);
    EXPECT_EQ(info->width, 640u);
    EXPECT_EQ(info->height, 360u) << "23 x 16 less 2 x 4";
  }
  const auto delta = read_h264_info(joined({unit(0x09), unit(0x06), unit(0x41), unit(0x41)}));
  ASSERT_TRUE(delta);
  EXPECT_FALSE(delta->is_keyframe);
}

TEST(H264Header, SizesAndCountsHaveLimits) {
  const auto with = [](auto change) {
    Sequence sequence;
    change(sequence);
    return keyframe(sequence);
  };
  EXPECT_TRUE(read_h264_info(with([](Sequence& s) { s.columns = 240; })));
  EXPECT_EQ(refusal(with([](Sequence& s) { s.columns = 241; })), ErrorCode::LimitExceeded);
  EXPECT_TRUE(read_h264_info(with([](Sequence& s) { s.rows = 135, s.cut_below = 0; })));
  EXPECT_EQ(refusal(with([](Sequence& s) { s.rows = 136, s.cut_below = 0; })), ErrorCode::LimitExceeded);
  EXPECT_EQ(refusal(with([](Sequence& s) { s.columns = UINT32_MAX; })), ErrorCode::LimitExceeded);
  EXPECT_EQ(refusal(with([](Sequence& s) { s.rows = 1; })), ErrorCode::LimitExceeded) << "8 rows";
  EXPECT_EQ(refusal(with([](Sequence& s) { s.cut_right = 8; })), ErrorCode::BadInput) << "a whole block";
  EXPECT_TRUE(read_h264_info(with([](Sequence& s) { s.references = kMaxVideoReferences; })));
  EXPECT_EQ(refusal(with([](Sequence& s) { s.references = kMaxVideoReferences + 1; })),
            ErrorCode::LimitExceeded);
  Bytes units;
  for (size_t i = 0; i < kMaxH264Units; ++i) units = joined({units, unit(0x41)});
  EXPECT_TRUE(read_h264_info(units));
  EXPECT_EQ(refusal(joined({units, unit(0x41)})), ErrorCode::LimitExceeded);
}

TEST(H264Header, OnlyThePlainFormIsLetThrough) {
  Sequence odd;
  odd.is_progressive = 0;
  EXPECT_EQ(refusal(keyframe(odd)), ErrorCode::Unsupported) << "interlaced";
  odd = {};
  odd.profile = 100;
  odd.colour_format = 3;
  EXPECT_EQ(refusal(keyframe(odd)), ErrorCode::Unsupported) << "4:4:4";
  const Bytes sequence = sequence_unit({});
  EXPECT_EQ(refusal({}), ErrorCode::BadInput);
  EXPECT_EQ(refusal(joined({{std::byte{1}}, keyframe({})})), ErrorCode::BadInput) << "something in front";
  EXPECT_EQ(refusal(joined({sequence, sequence, unit(0x68), unit(0x65)})), ErrorCode::BadInput)
      << "two sequences";
  EXPECT_EQ(refusal(joined({sequence, unit(0x68), unit(0x41)})), ErrorCode::BadInput) << "no key slice";
  EXPECT_EQ(refusal(joined({unit(0x68), unit(0x41)})), ErrorCode::BadInput) << "parameters of a delta";
  EXPECT_EQ(refusal(joined({keyframe({}), unit(0x41)})), ErrorCode::BadInput) << "two frames";
  EXPECT_EQ(refusal(unit(0x42)), ErrorCode::BadInput) << "a partition";
  EXPECT_EQ(refusal(unit(0xc1)), ErrorCode::BadInput) << "the forbidden bit";
  EXPECT_EQ(refusal(joined({unit(0x41), {std::byte{0}, std::byte{0}, std::byte{1}}})), ErrorCode::BadInput);
  for (size_t size = 1; size < sequence.size() - 4; ++size) {
    Bytes cut(sequence.begin(), sequence.begin() + 4 + static_cast<ptrdiff_t>(size) - 1);
    EXPECT_EQ(refusal(joined({cut, unit(0x68), unit(0x65)})), ErrorCode::BadInput) << size;
  }
}

TEST(H264, ABuildWithoutItSaysSo) {
  if (has_h264_decoder()) GTEST_SKIP() << "this build has H.264";
  EXPECT_EQ(H264Encoder::make({kWidth, kHeight, 30.0, 1e6}).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(decodable_picture_codecs() & codec_bit(PictureCodec::H264), 0u);
  EXPECT_EQ(encodable_picture_codecs() & codec_bit(PictureCodec::H264), 0u);
  FrameHeader header;
  header.opcode = Opcode::H264Frame;
  EXPECT_EQ(PictureDecoder().decode(header, keyframe({})).error().code, ErrorCode::Unsupported);
}

// ---- the codec, where the build has it ----

class H264Stream : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_h264_decoder()) GTEST_SKIP() << "built without libavcodec (CMake: -DSTRANDCAST_H264=ON)";
    if (!has_h264_encoder()) GTEST_SKIP() << "libavcodec has no H.264 encoder that starts here";
  }
  static H264Encoder make_encoder(double bits_per_s = 2e6) {
    auto encoder = H264Encoder::make({kWidth, kHeight, 30.0, bits_per_s});
    EXPECT_TRUE(encoder) << encoder.error().to_string();
    return std::move(*encoder);
  }
  static H264Decoder make_decoder() { return std::move(*H264Decoder::make()); }
};

TEST_F(H264Stream, EveryPictureComesOutAtOnceAndOnlyTheFirstIsAKeyframe) {
  H264Encoder encoder = make_encoder();
  H264Decoder decoder = make_decoder();
  for (int i = 0; i < 40; ++i) {
    const Image image = waving_lines(kWidth, kHeight, 0.1 * i);
    const auto bytes = encoder.encode(image, Frame::Delta, Rate::Target);
    ASSERT_TRUE(bytes) << bytes.error().to_string();
    EXPECT_EQ(read_h264_info(*bytes)->is_keyframe, i == 0);
    const auto back = decoder.decode(*bytes);
    ASSERT_TRUE(back) << i << ": " << back.error().to_string();
    EXPECT_GT(psnr(image, *back), psnr(waving_lines(kWidth, kHeight, 0.1 * (i - 1)), *back))
        << "this one, not the last";
  }
}

/// No picture helps with the next, so every rate is too low for it.
Image noise(uint32_t seed) {
  Image image{kWidth, kHeight, {}};
  for (uint32_t i = 0; i < kWidth * kHeight; ++i) {
    seed = seed * 1664525u + 1013904223u;
    const auto level = static_cast<uint8_t>(seed >> 24);
    image.rgba.insert(image.rgba.end(), {level, level, level, 255});
  }
  return image;
}

TEST_F(H264Stream, TheRateIsACapAndMayChangeWithoutAKeyframe) {
  H264Encoder encoder = make_encoder(1e6);
  const auto mean_bytes = [&](uint32_t first, uint32_t count) {
    size_t bytes = 0;
    for (uint32_t i = first; i < first + count; ++i) {
      const auto frame = encoder.encode(noise(i), Frame::Delta, Rate::Target);
      EXPECT_TRUE(frame);
      EXPECT_EQ(read_h264_info(*frame)->is_keyframe, i == 0);
      bytes += frame->size();
    }
    return static_cast<double>(bytes) / count;
  };
  (void)mean_bytes(0, 30);
  EXPECT_NEAR(mean_bytes(30, 60), 1e6 / 30.0 / 8.0, 0.25 * 1e6 / 30.0 / 8.0);
  encoder.set_bits_per_s(4e5);
  (void)mean_bytes(90, 30);
  EXPECT_NEAR(mean_bytes(120, 60), 4e5 / 30.0 / 8.0, 0.25 * 4e5 / 30.0 / 8.0);
}

TEST_F(H264Stream, AKeyframeComesWhenAskedForAndStandsAlone) {
  H264Encoder encoder = make_encoder();
  for (int i = 0; i < 10; ++i)
    ASSERT_TRUE(encoder.encode(waving_lines(kWidth, kHeight, 0.1 * i), Frame::Delta, Rate::Target));
  const Image image = waving_lines(kWidth, kHeight, 1.0);
  const auto bytes = encoder.encode(image, Frame::Keyframe, Rate::Target);
  ASSERT_TRUE(bytes);
  const auto info = read_h264_info(*bytes);
  ASSERT_TRUE(info) << info.error().to_string();
  EXPECT_TRUE(info->is_keyframe);
  EXPECT_EQ(info->width, kWidth);
  EXPECT_EQ(info->height, kHeight);
  H264Decoder decoder = make_decoder();
  const auto back = decoder.decode(*bytes);
  ASSERT_TRUE(back) << back.error().to_string();
  EXPECT_GT(psnr(image, *back), 20.0);
}

TEST_F(H264Stream, TheFinestFrameIsWithinItsQuantiser) {
  // Quantiser 12 has steps of 2.5 (ITU-T H.264, table 8-15 gives 0.625 for 0, doubled every 6), at quality 12
  // a few more: within 8 levels, were every coefficient wrong by a whole step of 8. Grey, as colours are
  // halved besides.
  constexpr double kLeastPsnr = 20.0 * 1.50339;  // 20 log10(255 / 8)
  H264Encoder encoder = make_encoder(2e5);
  H264Decoder decoder = make_decoder();
  const Image image = in_grey(waving_lines(kWidth, kHeight, 0.4));
  ASSERT_TRUE(decoder.decode(*encoder.encode(image, Frame::Delta, Rate::Target)));
  const auto back = decoder.decode(*encoder.encode(image, Frame::Delta, Rate::Finest));
  ASSERT_TRUE(back) << back.error().to_string();
  EXPECT_GE(psnr(image, *back), kLeastPsnr);
}

TEST_F(H264Stream, BlackAndWhiteStayBlackAndWhite) {
  for (const uint8_t level : {uint8_t{0}, uint8_t{128}, uint8_t{255}}) {
    const Image image{kWidth, kHeight, std::vector<uint8_t>(size_t{kWidth} * kHeight * 4, level)};
    H264Encoder encoder = make_encoder();
    const auto back = make_decoder().decode(*encoder.encode(image, Frame::Keyframe, Rate::Finest));
    ASSERT_TRUE(back);
    for (size_t i = 0; i < 4 * 50; i += 4) EXPECT_NEAR(back->rgba[i], level, 4) << i;
  }
}

TEST_F(H264Stream, WrongSizesAndRatesAreRefused) {
  EXPECT_EQ(H264Encoder::make({8, 100, 30.0, 1e6}).error().code, ErrorCode::BadInput);
  EXPECT_EQ(H264Encoder::make({101, 100, 30.0, 1e6}).error().code, ErrorCode::BadInput);
  EXPECT_EQ(H264Encoder::make({100, kMaxPictureHeight + 2, 30.0, 1e6}).error().code, ErrorCode::BadInput);
  EXPECT_EQ(H264Encoder::make({100, 100, 0.0, 1e6}).error().code, ErrorCode::BadInput);
  EXPECT_EQ(H264Encoder::make({100, 100, 30.0, std::nan("")}).error().code, ErrorCode::BadInput);
  H264Encoder encoder = make_encoder();
  EXPECT_FALSE(encoder.encode(waving_lines(kWidth + 2, kHeight, 0.0), Frame::Delta, Rate::Target));
}

TEST_F(H264Stream, ADeltaNeedsItsKeyframe) {
  H264Encoder encoder = make_encoder();
  const auto key = *encoder.encode(waving_lines(kWidth, kHeight, 0.0), Frame::Delta, Rate::Target);
  const auto delta = *encoder.encode(waving_lines(kWidth, kHeight, 0.1), Frame::Delta, Rate::Target);
  H264Decoder decoder = make_decoder();
  EXPECT_EQ(decoder.decode(delta).error().code, ErrorCode::BadInput);
  EXPECT_TRUE(decoder.decode(key));
  EXPECT_TRUE(decoder.decode(delta));
}

TEST_F(H264Stream, APartOfAFrameIsNoPicture) {
  H264Encoder encoder = make_encoder();
  const Bytes key = *encoder.encode(waving_lines(kWidth, kHeight, 0.0), Frame::Delta, Rate::Target);
  const Bytes delta = *encoder.encode(waving_lines(kWidth, kHeight, 0.3), Frame::Delta, Rate::Target);
  H264Decoder decoder = make_decoder();
  for (const size_t quarters : {1, 2, 3}) {
    ASSERT_TRUE(decoder.decode(key));
    EXPECT_FALSE(decoder.decode(std::span(delta).first(delta.size() * quarters / 4))) << quarters;
    EXPECT_FALSE(decoder.decode(delta)) << "only a keyframe helps";
    EXPECT_FALSE(decoder.decode(std::span(key).first(key.size() * quarters / 4))) << quarters;
  }
}

TEST_F(H264Stream, TheHeaderSaysWhetherItStandsAlone) {
  H264Encoder encoder = make_encoder();
  const Bytes key = *encoder.encode(waving_lines(kWidth, kHeight, 0.0), Frame::Delta, Rate::Target);
  const Bytes delta = *encoder.encode(waving_lines(kWidth, kHeight, 0.3), Frame::Delta, Rate::Target);
  const auto header = [](uint32_t sequence, uint32_t base) {
    FrameHeader made;
    made.opcode = Opcode::H264Frame;
    made.stream_id = kPictureStreamBit;
    made.sequence = sequence;
    made.base_sequence = base;
    return made;
  };
  PictureDecoder decoder;
  ASSERT_TRUE(decoder.decode(header(1, 0), key));
  EXPECT_EQ(decoder.decode(header(2, 0), delta).error().code, ErrorCode::BadInput) << "a delta as a keyframe";
  ASSERT_TRUE(decoder.decode(header(1, 0), key));
  EXPECT_EQ(decoder.decode(header(2, 1), key).error().code, ErrorCode::BadInput) << "a keyframe as a delta";
  ASSERT_TRUE(decoder.decode(header(1, 0), key));
  EXPECT_EQ(decoder.decode(header(3, 2), delta).error().code, ErrorCode::Unavailable) << "2 never came";
  ASSERT_TRUE(decoder.decode(header(1, 0), key));
  EXPECT_TRUE(decoder.decode(header(2, 1), delta));
}

TEST_F(H264Stream, DamageNeverCrashesAndAKeyframeMendsEverything) {
  H264Encoder encoder = make_encoder();
  const auto key = *encoder.encode(waving_lines(kWidth, kHeight, 0.0), Frame::Keyframe, Rate::Target);
  const auto delta = *encoder.encode(waving_lines(kWidth, kHeight, 0.4), Frame::Delta, Rate::Target);
  H264Decoder decoder = make_decoder();
  const auto good = decoder.decode(key);
  ASSERT_TRUE(good);
  uint32_t seed = 7;
  const auto random = [&] { return seed = seed * 1664525u + 1013904223u, seed >> 8; };
  int refused = 0;
  for (int round = 0; round < 600; ++round) {
    auto bad = round % 2 == 0 ? key : delta;
    for (uint32_t i = 0; i <= random() % 4; ++i)
      bad[random() % bad.size()] = static_cast<std::byte>(random());
    if (random() % 4 == 0) bad.resize(random() % bad.size());
    if (const auto image = decoder.decode(bad)) {
      ASSERT_EQ(image->rgba.size(), size_t{image->width} * image->height * 4);
    } else {
      ++refused;
    }
    if (round % 50 != 0) continue;
    const auto mended = decoder.decode(key);
    ASSERT_TRUE(mended) << round;
    EXPECT_TRUE(*mended == *good) << round;
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace strandcast
