#include "common/pictures/picture.h"

#include <utility>

#include "common/pictures/video_rows.h"

namespace strandcast {
namespace {

class OneMessage : public Picture {
 public:
  explicit OneMessage(EncodedFramePtr frame) : frame_(std::move(frame)) {}
  uint32_t sequence() const override { return frame_->header.sequence; }
  bool can_follow(uint32_t base) const override {
    const FrameHeader& header = frame_->header;
    return base != header.sequence && (header.base_sequence == 0 || header.base_sequence == base);
  }
  EncodedFramePtr after(uint32_t base) const override { return can_follow(base) ? frame_ : nullptr; }
  size_t message_bytes() const override { return frame_->message.size(); }

 private:
  EncodedFramePtr frame_;
};

}  // namespace

PictureCodecs decodable_picture_codecs() {
  static const bool has_h264 = is_h264_installed();
  return has_h264 ? kAllPictureCodecs : kAllPictureCodecs & ~codec_bit(PictureCodec::H264);
}

PictureCodecs encodable_picture_codecs() {
  static const bool has_h264 = make_video_encoder(PictureCodec::H264, {640, 360}).ok();
  return has_h264 ? kAllPictureCodecs : kAllPictureCodecs & ~codec_bit(PictureCodec::H264);
}

const char* to_string(PictureCodec codec) {
  switch (codec) {
    case PictureCodec::Jpeg:
      return "jpeg";
    case PictureCodec::JpegTiles:
      return "tiles";
    case PictureCodec::Vp8:
      return "vp8";
    case PictureCodec::H264:
      return "h264";
  }
  return "unknown";
}

PicturePtr make_picture(EncodedFramePtr frame) {
  return frame == nullptr ? nullptr : std::make_shared<const OneMessage>(std::move(frame));
}

}  // namespace strandcast
