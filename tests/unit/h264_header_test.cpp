// What is read of an H.264 frame before it is decoded, in every build.
#include "common/pictures/h264_header.h"

#include "common/pictures/picture_decoder.h"

namespace strandcast::h264_header_test {
namespace {

using Bytes = std::vector<std::byte>;

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
  if ((decodable_picture_codecs() & codec_bit(PictureCodec::H264)) != 0)
    GTEST_SKIP() << "this build has H.264";
  EXPECT_EQ(make_video_encoder(PictureCodec::H264, {160, 90}).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(encodable_picture_codecs() & codec_bit(PictureCodec::H264), 0u);
  FrameHeader header;
  header.opcode = Opcode::H264Frame;
  EXPECT_EQ(PictureDecoder().decode(header, keyframe({})).error().code, ErrorCode::Unsupported);
}

}  // namespace
}  // namespace strandcast::h264_header_test
