// PictureDecoder: decodes picture messages of any codec into the newest picture. Input is untrusted; a
// message that cannot be used leaves the picture unchanged. One thread.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "common/base/result.h"
#include "common/pictures/jpeg_tiles.h"
#include "common/pictures/picture.h"
#include "common/pictures/video_codec.h"

namespace strandcast {

class PictureDecoder {
 public:
  /// Decodes an opcode JpegFrame, JpegTiles, Vp8Frame or H264Frame, if the build has it. BadInput or
  /// LimitExceeded for damage, Unavailable if the picture's base was missed. After any error the caller must
  /// request a whole picture.
  Status decode(const FrameHeader& header, std::span<const std::byte> payload);

  /// Returns the newest picture; null before the first.
  const Image* image() const { return has_image_ ? &image_ : nullptr; }

 private:
  struct Place {  // of the picture that changes build on
    uint16_t stream_id = 0;
    uint32_t sequence = 0;
    Opcode opcode = Opcode::JpegFrame;
  };
  Status check_base(const FrameHeader& header);
  Status decode_whole(std::span<const std::byte> payload);
  Status decode_tiles(const FrameHeader& header, std::span<const std::byte> payload);
  Status decode_video(PictureCodec codec, const FrameHeader& header, std::span<const std::byte> payload);

  Image image_;
  bool has_image_ = false;
  std::optional<Place> place_;  // nothing: only a whole picture helps
  TileDecoder tiles_;
  std::unique_ptr<VideoDecoder> video_;  // of the codec that came last; null before the first
};

}  // namespace strandcast
