// H.264 pictures of two slices, which our encoder does not make but others do: one that is lost or damaged is
// seen. Only in builds with libavcodec, whose x264 makes the stream here.
extern "C" {
#include <libavcodec/avcodec.h>
}

#include "common/pictures/video_codec.h"

namespace strandcast::h264_slices_test {
namespace {

using Bytes = std::vector<std::byte>;

constexpr uint32_t kWidth = 160, kHeight = 96;
constexpr int kSlices = 2;

struct Encoder {
  AVCodecContext* context = nullptr;
  AVFrame* frame = av_frame_alloc();
  AVPacket* packet = av_packet_alloc();
  Encoder() = default;
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;
  ~Encoder() {
    avcodec_free_context(&context);
    av_frame_free(&frame);
    av_packet_free(&packet);
  }
};

/// A keyframe and the deltas after it, grey noise, so that every slice is long: libavcodec reads two bytes
/// beyond an end without complaint, and a still picture fits into those. Empty without x264.
std::vector<Bytes> two_slice_stream(int frame_count) {
  av_log_set_level(AV_LOG_QUIET);
  const AVCodec* codec = avcodec_find_encoder_by_name("libx264");
  if (codec == nullptr) return {};
  Encoder encoder;
  encoder.context = avcodec_alloc_context3(codec);
  encoder.context->width = kWidth;
  encoder.context->height = kHeight;
  encoder.context->pix_fmt = AV_PIX_FMT_YUV420P;
  encoder.context->time_base = {1, 30};
  encoder.context->gop_size = 1000;
  encoder.context->max_b_frames = 0;
  encoder.context->refs = 1;
  encoder.context->thread_count = 1;
  encoder.context->slices = kSlices;
  AVDictionary* options = nullptr;
  av_dict_set(&options, "preset", "superfast", 0);
  av_dict_set(&options, "tune", "zerolatency", 0);
  const int opened = avcodec_open2(encoder.context, codec, &options);
  av_dict_free(&options);
  if (opened < 0) return {};
  encoder.frame->format = AV_PIX_FMT_YUV420P;
  encoder.frame->width = kWidth;
  encoder.frame->height = kHeight;
  EXPECT_GE(av_frame_get_buffer(encoder.frame, 0), 0);
  std::vector<Bytes> frames;
  for (int i = 0; i < frame_count; ++i) {
    EXPECT_GE(av_frame_make_writable(encoder.frame), 0);
    uint32_t seed = static_cast<uint32_t>(i);
    for (int plane = 0; plane < 3; ++plane) {
      const uint32_t half = plane == 0 ? 1 : 2;
      for (uint32_t y = 0; y < kHeight / half; ++y) {
        uint8_t* row = encoder.frame->data[plane] + ptrdiff_t{y} * encoder.frame->linesize[plane];
        for (uint32_t x = 0; x < kWidth / half; ++x) {
          seed = seed * 1664525u + 1013904223u;
          row[x] = plane == 0 ? static_cast<uint8_t>(96 + (seed >> 26)) : uint8_t{128};
        }
      }
    }
    encoder.frame->pts = i;
    EXPECT_GE(avcodec_send_frame(encoder.context, encoder.frame), 0);
    EXPECT_GE(avcodec_receive_packet(encoder.context, encoder.packet), 0);
    const auto* begin = reinterpret_cast<const std::byte*>(encoder.packet->data);
    frames.emplace_back(begin, begin + encoder.packet->size);
    av_packet_unref(encoder.packet);
  }
  return frames;
}

/// Where the units begin that hold slices, start codes included.
std::vector<size_t> slice_starts(const Bytes& frame) {
  std::vector<size_t> starts;
  for (size_t i = 0; i + 3 < frame.size(); ++i) {
    const bool is_start =
        frame[i] == std::byte{0} && frame[i + 1] == std::byte{0} && frame[i + 2] == std::byte{1};
    const auto kind = std::to_integer<uint32_t>(frame[i + 3]) & 0x1f;
    if (is_start && (kind == 1 || kind == 5)) starts.push_back(i);
  }
  return starts;
}

class H264Slices : public testing::Test {
 protected:
  void SetUp() override {
    if (frames_.empty()) GTEST_SKIP() << "libavcodec has no H.264 encoder that starts here";
    decoder_ = std::move(*make_video_decoder(PictureCodec::H264));
    for (const Bytes& frame : frames_) ASSERT_EQ(slice_starts(frame).size(), size_t{kSlices});
  }
  /// Decodes what comes before `index`, then whether this frame is taken in its place.
  bool is_taken(size_t index, const Bytes& frame) {
    for (size_t i = 0; i < index; ++i) EXPECT_TRUE(decoder_->decode(frames_[i])) << i;
    return decoder_->decode(frame).ok();
  }

  const std::vector<Bytes> frames_ = two_slice_stream(4);
  std::unique_ptr<VideoDecoder> decoder_;
};

TEST_F(H264Slices, AllOfThemMakeAPicture) {
  for (size_t i = 0; i < frames_.size(); ++i) EXPECT_TRUE(is_taken(i, frames_[i])) << i;
}

TEST_F(H264Slices, ALostOneIsSeen) {
  for (size_t i = 0; i < frames_.size(); ++i) {
    const std::vector<size_t> starts = slice_starts(frames_[i]);
    const auto begin = frames_[i].begin();
    const auto second = begin + static_cast<ptrdiff_t>(starts[1]);
    EXPECT_FALSE(is_taken(i, Bytes(begin, second))) << "the second of frame " << i;
    Bytes without_first(begin, begin + static_cast<ptrdiff_t>(starts[0]));
    without_first.insert(without_first.end(), second, frames_[i].end());
    EXPECT_FALSE(is_taken(i, without_first)) << "the first of frame " << i;
  }
}

TEST_F(H264Slices, ACutOneIsSeen) {
  for (size_t i = 0; i < frames_.size(); ++i) {
    const size_t second = slice_starts(frames_[i])[1], size = frames_[i].size();
    for (const size_t quarters : {1, 2, 3}) {
      const size_t kept = second + (size - second) * quarters / 4;
      EXPECT_FALSE(is_taken(i, Bytes(frames_[i].begin(), frames_[i].begin() + static_cast<ptrdiff_t>(kept))))
          << quarters << " quarters of the second of frame " << i;
    }
  }
}

TEST_F(H264Slices, ADamagedOneLeavesNoChainBehind) {
  // Some damage decodes to another picture; what does not must end the chain until a keyframe begins it anew.
  constexpr size_t kSteps = 60;
  const size_t first = slice_starts(frames_[1])[1] + 5, size = frames_[1].size();
  size_t refused = 0;
  for (size_t step = 0; step < kSteps; ++step) {
    Bytes bad = frames_[1];
    bad[first + step * (size - first) / kSteps] ^= std::byte{0xff};
    if (is_taken(1, bad)) continue;
    ++refused;
    EXPECT_FALSE(decoder_->decode(frames_[2])) << "only a keyframe helps, step " << step;
  }
  fmt::print("{} of {} damaged slices were refused\n", refused, kSteps);
  EXPECT_GT(refused, 0);
  EXPECT_TRUE(is_taken(1, frames_[1]));
}

}  // namespace
}  // namespace strandcast::h264_slices_test
