#include "common/pictures/picture_decoder.h"

#include "tests/support/test_pictures.h"

namespace strandcast::picture_decoder_test {
namespace {

using test::waving_lines;

constexpr uint32_t kWidth = 100, kHeight = 80;

std::vector<std::byte> tiles_of(const Image& image, std::vector<uint16_t> places) {
  auto encoder = TileEncoder::make();
  std::vector<CodedTile> tiles;
  for (const uint16_t place : places) tiles.push_back(*encoder->encode(image, place, 80, TileChroma::Halved));
  std::vector<PlacedTile> placed;
  for (size_t i = 0; i < tiles.size(); ++i) placed.push_back({places[i], &tiles[i]});
  return pack_tiles(image.width, image.height, placed);
}

FrameHeader header(Opcode opcode, uint32_t sequence, uint32_t base_sequence) {
  FrameHeader made;
  made.opcode = opcode;
  made.stream_id = kPictureStreamBit;
  made.sequence = sequence;
  made.base_sequence = base_sequence;
  return made;
}

class Decoding : public testing::Test {
 protected:
  const Image image_ = waving_lines(kWidth, kHeight, 0.0);
  const std::vector<std::byte> whole_ = tiles_of(image_, {0, 1, 2, 3});
  const std::vector<std::byte> change_ = tiles_of(waving_lines(kWidth, kHeight, 1.0), {1});
  PictureDecoder decoder_;
};

TEST_F(Decoding, AChangeIsForItsBaseOnly) {
  EXPECT_EQ(decoder_.decode(header(Opcode::JpegTiles, 2, 1), change_).error().code, ErrorCode::Unavailable);
  EXPECT_EQ(decoder_.image(), nullptr);
  ASSERT_TRUE(decoder_.decode(header(Opcode::JpegTiles, 1, 0), whole_));
  const Image before = *decoder_.image();
  EXPECT_FALSE(decoder_.decode(header(Opcode::JpegTiles, 3, 2), change_));
  FrameHeader other = header(Opcode::JpegTiles, 2, 1);
  other.stream_id = kPictureStreamBit | 1;
  EXPECT_FALSE(decoder_.decode(other, change_)) << "of another class";
  EXPECT_FALSE(decoder_.decode(header(Opcode::Vp8Frame, 2, 1), change_)) << "of another codec";
  EXPECT_TRUE(*decoder_.image() == before);
  ASSERT_TRUE(decoder_.decode(header(Opcode::JpegTiles, 2, 1), change_));
  EXPECT_FALSE(*decoder_.image() == before);
}

TEST_F(Decoding, AfterDamageOnlyAWholePictureHelps) {
  ASSERT_TRUE(decoder_.decode(header(Opcode::JpegTiles, 1, 0), whole_));
  const Image before = *decoder_.image();
  EXPECT_FALSE(decoder_.decode(header(Opcode::JpegTiles, 2, 1), std::span(change_).first(20)));
  EXPECT_FALSE(decoder_.decode(header(Opcode::JpegTiles, 2, 1), change_));
  EXPECT_TRUE(*decoder_.image() == before);
  EXPECT_TRUE(decoder_.decode(header(Opcode::JpegTiles, 3, 0), whole_));
  EXPECT_TRUE(decoder_.decode(header(Opcode::JpegTiles, 4, 3), change_));
}

TEST_F(Decoding, CodecsMayFollowEachOther) {
  const auto encoder = make_video_encoder(PictureCodec::Vp8, {kWidth, kHeight, 30.0, 1e6});
  ASSERT_TRUE(encoder);
  const auto code = [&](double phase) {
    return *(*encoder)->encode(waving_lines(kWidth, kHeight, phase), VideoFrame::Delta, VideoRate::Target);
  };
  ASSERT_TRUE(decoder_.decode(header(Opcode::JpegTiles, 1, 0), whole_));
  const auto key = code(0.0), delta = code(0.1);
  EXPECT_FALSE(decoder_.decode(header(Opcode::Vp8Frame, 2, 0), delta)) << "a delta that says it stands alone";
  EXPECT_FALSE(decoder_.decode(header(Opcode::Vp8Frame, 2, 1), key)) << "a keyframe that says it does not";
  ASSERT_TRUE(decoder_.decode(header(Opcode::Vp8Frame, 2, 0), key));
  ASSERT_TRUE(decoder_.decode(header(Opcode::Vp8Frame, 3, 2), delta));
  ASSERT_TRUE(decoder_.decode(header(Opcode::JpegFrame, 4, 0), *encode_jpeg(waving_lines(16, 16, 0.0), 80)));
  EXPECT_EQ(decoder_.image()->width, 16u);
  EXPECT_FALSE(decoder_.decode(header(Opcode::JpegTiles, 5, 4), change_));
}

TEST_F(Decoding, AJpegBeyondTheSizeOfPicturesIsRefused) {
  const auto jpeg = encode_jpeg(waving_lines(kMaxPictureWidth + 1, 16, 0.0), 30);
  ASSERT_TRUE(jpeg);
  EXPECT_EQ(decoder_.decode(header(Opcode::JpegFrame, 1, 0), *jpeg).error().code, ErrorCode::LimitExceeded);
}

TEST_F(Decoding, WhatIsNoPictureIsRefused) {
  for (const Opcode opcode : {Opcode::Asset, Opcode::StrandDelta, Opcode::Control})
    EXPECT_FALSE(decoder_.decode(header(opcode, 1, 0), whole_));
}

}  // namespace
}  // namespace strandcast::picture_decoder_test
