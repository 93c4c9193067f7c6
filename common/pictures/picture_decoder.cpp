#include "common/pictures/picture_decoder.h"

#include <utility>

namespace strandcast {
Status PictureDecoder::decode(const FrameHeader& header, std::span<const std::byte> payload) {
  RETURN_IF_ERROR(check_base(header));
  place_.reset();
  switch (header.opcode) {
    case Opcode::JpegFrame:
      RETURN_IF_ERROR(decode_whole(payload));
      break;
    case Opcode::JpegTiles:
      RETURN_IF_ERROR(decode_tiles(header, payload));
      break;
    case Opcode::Vp8Frame:
      RETURN_IF_ERROR(decode_video(PictureCodec::Vp8, header, payload));
      break;
    case Opcode::H264Frame:
      RETURN_IF_ERROR(decode_video(PictureCodec::H264, header, payload));
      break;
    default:
      return make_error(ErrorCode::BadInput, "opcode 0x{:02x} is no picture",
                        static_cast<int>(header.opcode));
  }
  has_image_ = true;
  place_ = Place{header.stream_id, header.sequence, header.opcode};
  return {};
}

Status PictureDecoder::check_base(const FrameHeader& header) {
  if (header.base_sequence == 0) return {};
  const bool is_next = place_ && place_->stream_id == header.stream_id && place_->opcode == header.opcode &&
                       place_->sequence == header.base_sequence;
  if (is_next) return {};
  return make_error(ErrorCode::Unavailable, "picture {} continues picture {} of stream {}, which is not here",
                    header.sequence, header.base_sequence, header.stream_id);
}

Status PictureDecoder::decode_whole(std::span<const std::byte> payload) {
  ASSIGN_OR_RETURN(image_, decode_jpeg(payload, {kMaxPictureWidth, kMaxPictureHeight}));
  return {};
}

Status PictureDecoder::decode_tiles(const FrameHeader& header, std::span<const std::byte> payload) {
  const bool is_whole = header.base_sequence == 0;
  return tiles_.decode(payload, is_whole ? TileDecoder::Scope::Whole : TileDecoder::Scope::Changes, image_);
}

Status PictureDecoder::decode_video(PictureCodec codec, const FrameHeader& header,
                                    std::span<const std::byte> payload) {
  if (video_ == nullptr || video_->codec() != codec) {
    ASSIGN_OR_RETURN(video_, make_video_decoder(codec));
  }
  ASSIGN_OR_RETURN(const VideoFrameInfo info, read_video_info(codec, payload));
  if (info.is_keyframe != (header.base_sequence == 0))
    return make_error(ErrorCode::BadInput, "a video {} with base {}",
                      info.is_keyframe ? "keyframe" : "delta frame", header.base_sequence);
  ASSIGN_OR_RETURN(image_, video_->decode(payload));
  return {};
}

}  // namespace strandcast
