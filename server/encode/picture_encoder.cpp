#include "server/encode/picture_encoder.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "common/pictures/jpeg_tiles.h"
#include "common/pictures/video_codec.h"
#include "server/encode/picture_ladder.h"

namespace strandcast {
namespace {

constexpr size_t kChannels = 4;

FrameHeader make_header(Opcode opcode, uint32_t sequence, uint32_t base_sequence, const PictureStamp& stamp) {
  FrameHeader header;
  header.opcode = opcode;
  header.stream_id = stamp.stream_id;
  header.sequence = sequence;
  header.base_sequence = base_sequence;
  header.sim_time_ns = stamp.sim_time_ns;
  header.send_time_ns = stamp.time_ns;
  header.flags = stamp.is_still ? kStillPicture : 0;
  return header;
}

Result<PicturePtr> one_message(const FrameHeader& header, std::span<const std::byte> payload) {
  PicturePtr picture = make_picture(make_encoded_frame(header, payload));
  if (picture == nullptr)
    return make_error(ErrorCode::LimitExceeded, "a picture of {} bytes does not fit into one message",
                      payload.size());
  return picture;
}

// ---- whole pictures, for clients that know nothing else ----

class WholeEncoder : public PictureEncoder {
 public:
  explicit WholeEncoder(uint32_t last_sequence) : sequence_(last_sequence) {}

  Result<PicturePtr> encode(const Image& image, int quality, const PictureStamp& stamp) override {
    if (image == image_) return PicturePtr();
    image_ = image;
    return code(quality, stamp);
  }
  Result<PicturePtr> whole(const PictureStamp&) override { return newest_; }
  Result<PicturePtr> still(const PictureStamp& stamp) override {
    if (quality_ >= kStillQuality) return PicturePtr();
    return code(kStillQuality, stamp);
  }
  uint32_t sequence() const override { return sequence_; }

 private:
  Result<PicturePtr> code(int quality, PictureStamp stamp) {
    ASSIGN_OR_RETURN(const auto jpeg, encode_jpeg(image_, quality));
    stamp.is_still = quality >= kStillQuality;
    ASSIGN_OR_RETURN(newest_, one_message(make_header(Opcode::JpegFrame, sequence_ + 1, 0, stamp), jpeg));
    ++sequence_;
    quality_ = quality;
    return newest_;
  }

  Image image_;
  int quality_ = 0;
  uint32_t sequence_;
  PicturePtr newest_;
};

// ---- the tiles that changed ----

/// A tile and the picture in which it became what it is.
struct DatedTile {
  uint32_t sequence = 0;
  std::shared_ptr<const CodedTile> tile;
};

class TilesPicture : public Picture {
 public:
  TilesPicture(FrameHeader header, uint32_t width, uint32_t height, uint32_t first_sequence,
               std::vector<DatedTile> tiles)
      : header_(header),
        width_(width),
        height_(height),
        first_sequence_(first_sequence),
        tiles_(std::move(tiles)),
        next_(make_after(header.sequence - 1)) {}

  uint32_t sequence() const override { return header_.sequence; }
  bool can_follow(uint32_t base) const override { return base != header_.sequence; }
  EncodedFramePtr after(uint32_t base) const override {
    if (!can_follow(base)) return nullptr;
    return base == header_.sequence - 1 ? next_ : make_after(base);
  }
  size_t message_bytes() const override { return next_->message.size(); }
  bool is_valid() const { return next_ != nullptr; }

 private:
  EncodedFramePtr make_after(uint32_t base) const {
    // A picture of before this encoder's first one, or one that never was, is none to build on.
    const bool is_whole = base < first_sequence_ || base > header_.sequence;
    std::vector<PlacedTile> wanted;
    for (size_t i = 0; i < tiles_.size(); ++i)
      if (is_whole || tiles_[i].sequence > base)
        wanted.push_back({static_cast<uint16_t>(i), tiles_[i].tile.get()});
    FrameHeader header = header_;
    header.base_sequence = is_whole ? 0 : base;
    return make_encoded_frame(header, pack_tiles(width_, height_, wanted));
  }

  const FrameHeader header_;
  const uint32_t width_, height_;
  const uint32_t first_sequence_;
  const std::vector<DatedTile> tiles_;
  const EncodedFramePtr next_;  // for viewers that missed nothing
};

class TilesEncoder : public PictureEncoder {
 public:
  TilesEncoder(TileEncoder encoder, uint32_t last_sequence)
      : encoder_(std::move(encoder)), sequence_(last_sequence), first_sequence_(last_sequence + 1) {}

  Result<PicturePtr> encode(const Image& image, int quality, const PictureStamp& stamp) override {
    const bool is_first = image_.rgba.empty();
    tiles_.resize(size_t{tiles_along(image.width)} * tiles_along(image.height));
    std::vector<uint32_t> changed;
    for (uint32_t i = 0; i < tiles_.size(); ++i)
      if (is_first || !is_same(image, i)) changed.push_back(i);
    if (changed.empty()) return PicturePtr();
    image_ = image;
    return code(changed, quality, TileChroma::Halved, stamp);
  }
  Result<PicturePtr> whole(const PictureStamp&) override { return newest_; }
  Result<PicturePtr> still(const PictureStamp& stamp) override {
    std::vector<uint32_t> coarse;
    for (uint32_t i = 0; i < tiles_.size(); ++i)
      if (tiles_[i].tile->chroma != TileChroma::Full) coarse.push_back(i);
    if (coarse.empty()) return PicturePtr();
    return code(coarse, kStillQuality, TileChroma::Full, stamp);
  }
  uint32_t sequence() const override { return sequence_; }

 private:
  bool is_same(const Image& image, uint32_t index) const {
    const uint32_t columns = tiles_along(image.width);
    const uint32_t left = index % columns * kTileSide, top = index / columns * kTileSide;
    const size_t row_bytes = std::min(kTileSide, image.width - left) * kChannels;
    for (uint32_t y = top; y < std::min(top + kTileSide, image.height); ++y) {
      const size_t at = (size_t{y} * image.width + left) * kChannels;
      if (std::memcmp(image.rgba.data() + at, image_.rgba.data() + at, row_bytes) != 0) return false;
    }
    return true;
  }

  Result<PicturePtr> code(std::span<const uint32_t> places, int quality, TileChroma chroma,
                          const PictureStamp& stamp) {
    const uint32_t sequence = sequence_ + 1;
    for (const uint32_t place : places) {
      ASSIGN_OR_RETURN(CodedTile tile, encoder_.encode(image_, place, static_cast<uint8_t>(quality), chroma));
      tiles_[place] = {sequence, std::make_shared<const CodedTile>(std::move(tile))};
    }
    auto picture = std::make_shared<const TilesPicture>(make_header(Opcode::JpegTiles, sequence, 0, stamp),
                                                        image_.width, image_.height, first_sequence_, tiles_);
    if (!picture->is_valid())
      return make_error(ErrorCode::LimitExceeded,
                        "the tiles of a picture of {} x {} do not fit into one message", image_.width,
                        image_.height);
    sequence_ = sequence;
    newest_ = std::move(picture);
    return newest_;
  }

  TileEncoder encoder_;
  Image image_;  // as it is shown
  std::vector<DatedTile> tiles_;
  uint32_t sequence_;
  const uint32_t first_sequence_;
  PicturePtr newest_;
};

// ---- video ----

double video_bits_per_s(uint32_t width, uint32_t height, double rate_hz, int quality) {
  return static_cast<double>(width) * height * rate_hz * video_bits_per_pixel(quality);
}

/// One chain for the class, at a given rate of bits.
class ChainEncoder : public PictureEncoder {
 public:
  ChainEncoder(std::unique_ptr<VideoEncoder> video, PictureCodec codec, double rate_hz,
               uint32_t last_sequence)
      : video_(std::move(video)), codec_(codec), rate_hz_(rate_hz), sequence_(last_sequence) {}

  Result<PicturePtr> encode(const Image& image, int quality, const PictureStamp& stamp) override {
    if (image == image_) return PicturePtr();
    video_->set_bits_per_s(video_bits_per_s(image.width, image.height, rate_hz_, quality));
    const VideoFrame kind = image_.rgba.empty() ? VideoFrame::Keyframe : VideoFrame::Delta;
    image_ = image;
    is_still_ = false;
    return code(kind, VideoRate::Target, stamp);
  }
  Result<PicturePtr> whole(const PictureStamp& stamp) override {
    is_still_ = false;
    return code(VideoFrame::Keyframe, VideoRate::Target, stamp);
  }
  int64_t whole_due_ns() const override { return keyframe_ns_ + kKeyframePauseNs; }
  Result<PicturePtr> still(const PictureStamp& stamp) override {
    if (is_still_) return PicturePtr();
    is_still_ = true;
    return code(VideoFrame::Delta, VideoRate::Finest, stamp);
  }
  uint32_t sequence() const override { return sequence_; }

 private:
  Result<PicturePtr> code(VideoFrame kind, VideoRate rate, const PictureStamp& stamp) {
    ASSIGN_OR_RETURN(const auto bytes, video_->encode(image_, kind, rate));
    ASSIGN_OR_RETURN(const VideoFrameInfo info, read_video_info(codec_, bytes));
    const uint32_t base = info.is_keyframe ? 0 : sequence_;
    ASSIGN_OR_RETURN(PicturePtr picture,
                     one_message(make_header(opcode_of(codec_), sequence_ + 1, base, stamp), bytes));
    if (info.is_keyframe) keyframe_ns_ = stamp.time_ns;
    ++sequence_;
    return picture;
  }

  const std::unique_ptr<VideoEncoder> video_;
  const PictureCodec codec_;
  const double rate_hz_;
  Image image_;
  bool is_still_ = false;
  int64_t keyframe_ns_ = -kKeyframePauseNs;
  uint32_t sequence_;
};

}  // namespace

Result<std::unique_ptr<PictureEncoder>> make_picture_encoder(const PictureView& view, double rate_hz,
                                                             uint32_t last_sequence) {
  std::unique_ptr<PictureEncoder> made;
  switch (view.codec) {
    case PictureCodec::Jpeg:
      made = std::make_unique<WholeEncoder>(last_sequence);
      break;
    case PictureCodec::JpegTiles: {
      ASSIGN_OR_RETURN(TileEncoder encoder, TileEncoder::make());
      made = std::make_unique<TilesEncoder>(std::move(encoder), last_sequence);
      break;
    }
    case PictureCodec::Vp8:
    case PictureCodec::H264: {
      const auto [width, height] = view.size;
      const double bits_per_s = video_bits_per_s(width, height, rate_hz, view.quality);
      ASSIGN_OR_RETURN(auto video, make_video_encoder(view.codec, {width, height, rate_hz, bits_per_s}));
      made = std::make_unique<ChainEncoder>(std::move(video), view.codec, rate_hz, last_sequence);
      break;
    }
  }
  return made;
}

}  // namespace strandcast
