#include "server/report/stream_pixels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/pictures/picture_decoder.h"
#include "server/encode/picture_encoder.h"

namespace strandcast {
namespace {

constexpr double kRateHz = 1.0 / kStreamFrameS;
constexpr int kQualities[] = {20, 50, 70, 80, 90, 95, 98, 100};
// Of pictures of 1280 x 720; of others in proportion to their pixels.
constexpr double kVideoMbitPerS[] = {0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0};
constexpr double kUsedShare = 0.3;
constexpr double kVideoPixels = 1280.0 * 720.0;

/// One codec at one setting, as a viewer that misses nothing gets it.
class PixelStream {
 public:
  virtual ~PixelStream() = default;
  /// Bytes of its message; 0 when the picture is the one before.
  virtual Result<size_t> take(const Image& image) = 0;
  virtual const Image& shown() const = 0;
};

class QualityStream final : public PixelStream {
 public:
  static Result<std::unique_ptr<PixelStream>> make(PictureCodec codec, RenderSize size, int quality) {
    PictureView view;
    view.size = size;
    view.codec = codec;
    view.quality = quality;
    auto stream = std::make_unique<QualityStream>();
    stream->quality_ = quality;
    ASSIGN_OR_RETURN(stream->encoder_, make_picture_encoder(view, kRateHz, 0));
    return std::unique_ptr<PixelStream>(std::move(stream));
  }
  Result<size_t> take(const Image& image) override {
    ASSIGN_OR_RETURN(const PicturePtr picture, encoder_->encode(image, quality_, {}));
    if (picture == nullptr) return size_t{0};
    const EncodedFramePtr frame = picture->after(std::exchange(sequence_, picture->sequence()));
    RETURN_IF_ERROR(decoder_.decode(frame->header, std::span(frame->message).subspan(kFrameHeaderBytes)));
    return frame->message.size();
  }
  const Image& shown() const override { return *decoder_.image(); }

 private:
  int quality_ = 0;
  std::unique_ptr<PictureEncoder> encoder_;
  PictureDecoder decoder_;
  uint32_t sequence_ = 0;
};

class VideoStream final : public PixelStream {
 public:
  static Result<std::unique_ptr<PixelStream>> make(PictureCodec codec, RenderSize size, double bits_per_s) {
    auto stream = std::make_unique<VideoStream>();
    ASSIGN_OR_RETURN(stream->encoder_,
                     make_video_encoder(codec, {size.width, size.height, kRateHz, bits_per_s}));
    ASSIGN_OR_RETURN(stream->decoder_, make_video_decoder(codec));
    return std::unique_ptr<PixelStream>(std::move(stream));
  }
  Result<size_t> take(const Image& image) override {
    ASSIGN_OR_RETURN(const auto frame, encoder_->encode(image, VideoFrame::Delta, VideoRate::Target));
    ASSIGN_OR_RETURN(shown_, decoder_->decode(frame));
    return frame.size() + kFrameHeaderBytes;
  }
  const Image& shown() const override { return shown_; }

 private:
  std::unique_ptr<VideoEncoder> encoder_;
  std::unique_ptr<VideoDecoder> decoder_;
  Image shown_;
};

Result<PixelPoint> measure_point(PixelStream& stream, const PixelClip& clip) {
  const size_t count = clip.picture->size() - 1;
  CHECK(count > kStartFrames && clip.hair->size() == clip.compared->size());
  PixelPoint point;
  point.distance_m = clip.distance_m;
  double bytes = 0.0;
  size_t k = 0;
  for (size_t i = 0; i < count; ++i) {
    ASSIGN_OR_RETURN(const size_t taken, stream.take((*clip.picture)[i]));
    if (i >= kStartFrames) bytes += static_cast<double>(taken);
    if (k == clip.compared->size() || (*clip.compared)[k] != i) continue;
    ASSIGN_OR_RETURN(const PictureError error,
                     picture_error(stream.shown(), (*clip.picture)[i], (*clip.hair)[k++]));
    const double share = 1.0 / static_cast<double>(clip.compared->size());
    point.psnr_db += share * error.psnr_db;
    point.ssim += share * error.ssim;
  }
  point.mbit_per_s = stream_mbit_per_s(bytes, count - kStartFrames);
  return point;
}

double ssim_db(double ssim) {
  constexpr double kNoDifference = 1e-10;
  return -10.0 * std::log10(std::max(1.0 - ssim, kNoDifference));
}

/// One codec's points at one distance, by rising rate.
std::vector<const PixelPoint*> curve_of(const std::vector<PixelPoint>& pixels, const std::string& codec,
                                        double distance_m) {
  std::vector<const PixelPoint*> curve;
  for (const PixelPoint& point : pixels)
    if (point.codec == codec && point.distance_m == distance_m) curve.push_back(&point);
  std::stable_sort(curve.begin(), curve.end(),
                   [](const PixelPoint* a, const PixelPoint* b) { return a->mbit_per_s < b->mbit_per_s; });
  return curve;
}

}  // namespace

double stream_mbit_per_s(double bytes, size_t frames) {
  return bytes * 8.0 / static_cast<double>(frames) / kStreamFrameS * 1e-6;
}

std::vector<std::string> missing_picture_codecs() {
  std::vector<std::string> missing;
  for (const PictureCodec codec : kPictureCodecs)
    if ((encodable_picture_codecs() & decodable_picture_codecs() & codec_bit(codec)) == 0)
      missing.emplace_back(to_string(codec));
  return missing;
}

uint32_t pixel_step_count() {
  size_t count = 0;
  for (const PictureCodec codec : kPictureCodecs)
    count += is_video(codec) ? std::size(kVideoMbitPerS) : std::size(kQualities);
  return static_cast<uint32_t>(count);
}

Result<std::vector<PixelPoint>> measure_pixels(
    const PixelClip& clip, const std::function<void(const std::string& doing)>& on_progress) {
  const RenderSize size{clip.picture->front().width, clip.picture->front().height};
  std::vector<PixelPoint> points;
  const auto add = [&](PictureCodec codec, const std::string& setting,
                       Result<std::unique_ptr<PixelStream>> stream) -> Status {
    on_progress(fmt::format("pictures by {} from {:g} m, {}", to_string(codec), clip.distance_m, setting));
    if (!stream) return stream.error();
    ASSIGN_OR_RETURN(PixelPoint point, measure_point(**stream, clip));
    point.codec = to_string(codec);
    point.setting = setting;
    points.push_back(std::move(point));
    return {};
  };
  const std::vector<std::string> missing = missing_picture_codecs();
  for (const PictureCodec codec : kPictureCodecs) {
    if (std::find(missing.begin(), missing.end(), to_string(codec)) != missing.end()) continue;
    if (is_video(codec)) {
      const double share = static_cast<double>(size.width) * size.height / kVideoPixels;
      for (const double full_mbit_per_s : kVideoMbitPerS) {
        const double mbit_per_s = share * full_mbit_per_s;
        RETURN_IF_ERROR(add(codec, fmt::format("{:.3g} Mbit/s asked for", mbit_per_s),
                            VideoStream::make(codec, size, 1e6 * mbit_per_s)));
        // It has what it can use.
        if (points.back().mbit_per_s < kUsedShare * mbit_per_s) break;
      }
    } else {
      for (const int quality : kQualities)
        RETURN_IF_ERROR(
            add(codec, fmt::format("quality {}", quality), QualityStream::make(codec, size, quality)));
    }
  }
  return points;
}

double look_db(const PixelPoint& point, LookMeasure measure) {
  return measure == LookMeasure::Psnr ? point.psnr_db : ssim_db(point.ssim);
}

double look_db(const StreamViewRow& row, LookMeasure measure) {
  return measure == LookMeasure::Psnr ? row.psnr_db : ssim_db(row.ssim);
}

std::optional<double> mbit_per_s_for(const std::vector<PixelPoint>& pixels, const std::string& codec,
                                     double distance_m, LookMeasure measure, double wanted_db) {
  const std::vector<const PixelPoint*> curve = curve_of(pixels, codec, distance_m);
  for (size_t i = 0; i < curve.size(); ++i) {
    const double here_db = look_db(*curve[i], measure);
    if (here_db < wanted_db) continue;
    if (i == 0) return curve[i]->mbit_per_s;
    const PixelPoint& below = *curve[i - 1];
    const double blend = (wanted_db - look_db(below, measure)) / (here_db - look_db(below, measure));
    return below.mbit_per_s * std::pow(curve[i]->mbit_per_s / below.mbit_per_s, blend);
  }
  return std::nullopt;
}

std::optional<double> psnr_db_at(const std::vector<PixelPoint>& pixels, const std::string& codec,
                                 double distance_m, double mbit_per_s) {
  const std::vector<const PixelPoint*> curve = curve_of(pixels, codec, distance_m);
  if (curve.empty() || mbit_per_s < curve.front()->mbit_per_s) return std::nullopt;
  for (size_t i = 1; i < curve.size(); ++i) {
    if (curve[i]->mbit_per_s < mbit_per_s) continue;
    const PixelPoint& below = *curve[i - 1];
    const double blend =
        std::log(mbit_per_s / below.mbit_per_s) / std::log(curve[i]->mbit_per_s / below.mbit_per_s);
    return below.psnr_db + blend * (curve[i]->psnr_db - below.psnr_db);
  }
  return curve.back()->psnr_db;
}

}  // namespace strandcast
