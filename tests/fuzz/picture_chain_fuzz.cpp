// libFuzzer entry: chains of picture messages of every codec, as the viewer decodes them. What decodes is a
// picture within the limits, an honest message gives exactly what its server shows, an error leaves the
// picture as it was, and after any damage the next whole picture mends everything. The input's layout is in
// picture_chain.h.
#include "tests/fuzz/picture_chain.h"

#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include "common/base/check.h"
#include "common/pictures/picture_decoder.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/support/test_pictures.h"

namespace strandcast::picture_chain_fuzz {
namespace {

constexpr size_t kPictures = 6;
constexpr size_t kSecondWhole = 3;
constexpr int kMostSteps = 24;
constexpr uint64_t kManyPixels = 1 << 19;  // more only cost time here
constexpr size_t kPayloadLengthAt = 12;
constexpr uint8_t kQuality = 70;
constexpr std::array<ImageLimit, kPictureSizes> kSizes = {{{100, 80}, {16, 16}, {64, 130}}};

/// What a good server sends for one codec and size, and what it shows.
struct Chain {
  std::vector<EncodedFramePtr> frame;  // frames 0 and kSecondWhole stand alone
  std::vector<Image> shown;
};

std::vector<std::byte> tiles_of(const Image& image, uint32_t first) {
  auto encoder = TileEncoder::make();
  CHECK(encoder.ok());
  const uint32_t count = tiles_along(image.width) * tiles_along(image.height);
  std::vector<CodedTile> tiles;
  std::vector<PlacedTile> placed;
  for (uint32_t i = first; i < count; ++i)
    tiles.push_back(encoder->encode(image, i, kQuality, static_cast<TileChroma>(i % 2)).value());
  for (uint32_t i = first; i < count; ++i) placed.push_back({static_cast<uint16_t>(i), &tiles[i - first]});
  return pack_tiles(image.width, image.height, placed);
}

Chain make_chain(PictureCodec codec, ImageLimit size, uint16_t number) {
  Chain chain;
  PictureDecoder decoder;
  std::unique_ptr<VideoEncoder> video;
  if (is_video(codec)) video = make_video_encoder(codec, {size.width, size.height, 30.0, 1e6}).value();
  for (size_t i = 0; i < kPictures; ++i) {
    const bool is_whole = i == 0 || i == kSecondWhole || codec == PictureCodec::Jpeg;
    const Image image = test::waving_lines(size.width, size.height, 0.4 * static_cast<double>(i));
    std::vector<std::byte> payload;
    if (codec == PictureCodec::Jpeg) payload = encode_jpeg(image, kQuality).value();
    if (codec == PictureCodec::JpegTiles)
      payload = tiles_of(image, is_whole ? 0 : tiles_along(size.width) * tiles_along(size.height) / 2);
    if (video != nullptr)
      payload = video->encode(image, is_whole ? VideoFrame::Keyframe : VideoFrame::Delta, VideoRate::Target)
                    .value();
    FrameHeader header;
    header.opcode = opcode_of(codec);
    header.stream_id = picture_stream_id(number);
    header.sequence = static_cast<uint32_t>(i) + 1;
    header.base_sequence = is_whole ? 0 : static_cast<uint32_t>(i);
    chain.frame.push_back(make_encoded_frame(header, payload));
    CHECK(decoder.decode(chain.frame.back()->header, payload).ok());
    chain.shown.push_back(*decoder.image());
  }
  return chain;
}

/// Without frames where this build has no encoder for them.
const std::vector<Chain>& chains() {
  static const std::vector<Chain> made = [] {
    std::vector<Chain> all;
    for (const PictureCodec codec : kPictureCodecs)
      for (const ImageLimit size : kSizes) {
        const bool is_here = (encodable_picture_codecs() & codec_bit(codec)) != 0;
        all.push_back(is_here ? make_chain(codec, size, static_cast<uint16_t>(all.size())) : Chain{});
      }
    return all;
  }();
  return made;
}

std::optional<PictureCodec> video_codec_of(Opcode opcode) {
  for (const PictureCodec codec : kPictureCodecs)
    if (is_video(codec) && opcode_of(codec) == opcode) return codec;
  return std::nullopt;
}

/// Of the picture that a payload announces, as far as that is known without decoding it.
uint64_t announced_pixels(Opcode opcode, std::span<const std::byte> payload) {
  if (const auto codec = video_codec_of(opcode)) {
    const auto info = read_video_info(*codec, payload);
    return info ? uint64_t{info->width} * info->height : 0;
  }
  FuzzInput input(payload);
  const uint64_t width = input.take<uint16_t>(), height = input.take<uint16_t>();
  return opcode == Opcode::JpegTiles ? width * height : 0;
}

class Game {
 public:
  void choose(uint8_t number) {
    const Chain& chosen = chains()[number % chains().size()];
    if (chosen.frame.empty()) return;
    chain_ = &chosen;
    next_ = 0;
    is_following_ = false;
  }

  void honest() {
    const EncodedFramePtr& frame = chain_->frame[next_];
    if (!is_following_ && frame->header.base_sequence != 0) next_ = next_ < kSecondWhole ? 0 : kSecondWhole;
    give_honest();
  }

  void lose_one() {
    next_ = (next_ + 1) % kPictures;
    const FrameHeader& header = chain_->frame[next_]->header;
    if (!is_following_ || header.base_sequence == 0) return honest();
    refuse_delta(header);
    is_following_ = false;
  }

  void hostile(PictureChainStep step, uint8_t flags, std::span<const std::byte> piece) {
    std::vector<std::byte> message = make_message(step, flags, piece);
    if ((flags & kFixPayload) != 0 && message.size() >= kFrameHeaderBytes) {
      const auto length = static_cast<uint32_t>(message.size() - kFrameHeaderBytes);
      std::memcpy(message.data() + kPayloadLengthAt, &length, sizeof(length));
    }
    const auto header = unpack_frame_header(message);
    if (!header) return;
    const auto payload = std::span<const std::byte>(message).subspan(kFrameHeaderBytes);
    if (announced_pixels(header->opcode, payload) > kManyPixels) return;
    const bool had_image = decoder_.image() != nullptr;
    const Image before = had_image ? *decoder_.image() : Image{};
    const Status decoded = decoder_.decode(*header, payload);
    is_following_ = false;
    if (decoded) {
      check_valid();
      const bool is_whole = header->base_sequence == 0;
      const auto codec = video_codec_of(header->opcode);
      CHECK(!codec || read_video_info(*codec, payload)->is_keyframe == is_whole);
      sequence_ = header->sequence;
      stream_id_ = header->stream_id;
      return;
    }
    CHECK((decoder_.image() != nullptr) == had_image);
    CHECK(!had_image || *decoder_.image() == before);
    const FrameHeader& change = chain_->frame[next_]->header;
    // A message that continues another picture touches nothing.
    const bool is_untouched = decoded.error().code == ErrorCode::Unavailable;
    if ((flags & kThenDelta) != 0 && !is_untouched && change.base_sequence != 0) refuse_delta(change);
  }

 private:
  void give_honest() {
    const EncodedFramePtr& frame = chain_->frame[next_];
    const auto payload = std::span<const std::byte>(frame->message).subspan(kFrameHeaderBytes);
    CHECK(decoder_.decode(frame->header, payload).ok());
    CHECK(*decoder_.image() == chain_->shown[next_]);
    sequence_ = frame->header.sequence;
    stream_id_ = frame->header.stream_id;
    next_ = (next_ + 1) % kPictures;
    is_following_ = true;
  }

  /// The honest picture of this header cannot follow here.
  void refuse_delta(const FrameHeader& header) {
    const auto payload =
        std::span<const std::byte>(chain_->frame[header.sequence - 1]->message).subspan(kFrameHeaderBytes);
    const Status decoded = decoder_.decode(header, payload);
    CHECK(!decoded.ok() && decoded.error().code == ErrorCode::Unavailable);
  }

  void check_valid() const {
    const Image* image = decoder_.image();
    CHECK(image != nullptr && image->width >= 1 && image->height >= 1);
    CHECK(image->width <= kMaxPictureWidth && image->height <= kMaxPictureHeight);
    CHECK(image->rgba.size() == size_t{image->width} * image->height * 4);
  }

  std::vector<std::byte> make_message(PictureChainStep step, uint8_t flags,
                                      std::span<const std::byte> piece) const {
    const std::vector<std::byte>& good = chain_->frame[next_]->message;
    if (step == PictureChainStep::Whole) return {piece.begin(), piece.end()};
    FuzzInput input(piece);
    if (step == PictureChainStep::Patched) {
      std::vector<std::byte> message = good;
      while (!input.is_empty()) {
        const size_t offset = input.take<uint16_t>() % message.size();
        message[offset] ^= static_cast<std::byte>(input.take<uint8_t>());
      }
      return message;
    }
    if (step == PictureChainStep::Spliced) {
      const size_t offset = input.take<uint16_t>() % (good.size() + 1);
      std::vector<std::byte> message(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(offset));
      const auto rest = input.take_rest();
      message.insert(message.end(), rest.begin(), rest.end());
      return message;
    }
    FrameHeader header;
    header.opcode = static_cast<Opcode>(static_cast<int>(Opcode::JpegFrame) + (flags >> kOpcodeShift));
    header.stream_id = stream_id_;
    header.sequence = sequence_ + 1;
    header.base_sequence = (flags & kAsWhole) != 0 ? 0 : sequence_;
    return make_encoded_frame(header, piece)->message;
  }

  PictureDecoder decoder_;
  const Chain* chain_ = &chains().front();
  size_t next_ = 0;            // honest picture that comes next
  bool is_following_ = false;  // the decoder shows the one before it
  uint32_t sequence_ = 0;      // last one decoded
  uint16_t stream_id_ = kPictureStreamBit;
};

}  // namespace

extern "C" int FUZZ_ENTRY(picture_chain)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  Game game;
  for (int i = 0; i < kMostSteps && !input.is_empty(); ++i) {
    const auto step = static_cast<PictureChainStep>(input.take<uint8_t>() % kPictureStepKinds);
    const auto flags = input.take<uint8_t>();
    if (step == PictureChainStep::Honest)
      game.honest();
    else if (step == PictureChainStep::Lost)
      game.lose_one();
    else if (step == PictureChainStep::Other)
      game.choose(flags);
    else
      game.hostile(step, flags, input.take_piece());
  }
  game.honest();
  return 0;
}

}  // namespace strandcast::picture_chain_fuzz
