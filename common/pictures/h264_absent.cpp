// H.264 in a build without libavcodec: nothing is there, and that is said.
#include "common/pictures/video_rows.h"

namespace strandcast {
namespace {

Error no_h264() {
  return make_error(ErrorCode::Unsupported, "this build has no H.264 (CMake: -DSTRANDCAST_H264=ON)");
}

}  // namespace

Result<std::unique_ptr<VideoEncoder>> make_h264_encoder(const VideoConfig&) {
  return no_h264();
}
Result<std::unique_ptr<VideoDecoder>> make_h264_decoder() {
  return no_h264();
}
bool is_h264_installed() {
  return false;
}

}  // namespace strandcast
