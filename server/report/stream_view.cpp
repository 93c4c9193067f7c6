#include "server/report/stream_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "common/base/check.h"
#include "common/pictures/picture_error.h"
#include "server/report/stream_pixels.h"
#include "server/report/view_painter.h"

namespace strandcast {
namespace {

constexpr uint32_t kSheetSide = 300;
// Of the differences on a sheet.
constexpr int kSheetGain = 8;
constexpr double kSheetBoundsM[] = {1e-4, 5e-4};

/// A stream of strands at one bound.
struct DecodedStrands {
  std::string codec;
  double bound_m = 0.0;
  double mbit_per_s = 0.0;
  std::vector<std::vector<glm::vec3>> position_m;  // of the compared frames
};

/// Chooses frames evenly among those that have a frame after them, which the codec rows compare too.
std::vector<size_t> compared_frames(size_t frame_count, size_t wanted) {
  CHECK(frame_count > kStartFrames + 1 && wanted > 0);
  const size_t count = frame_count - 1 - kStartFrames;
  std::vector<size_t> frames;
  for (size_t i = 0; i < std::min(wanted, count); ++i)
    frames.push_back(kStartFrames + (2 * i + 1) * count / (2 * std::min(wanted, count)));
  return frames;
}

Result<DecodedStrands> decode_at(const std::string& name, double bound_m, const StreamRecording& recording,
                                 const std::vector<size_t>& compared) {
  const std::vector<StreamCodecRow> codecs = own_stream_codecs(bound_m);
  const auto row = std::find_if(codecs.begin(), codecs.end(),
                                [&](const StreamCodecRow& codec) { return codec.name == name; });
  CHECK(row != codecs.end());
  ASSIGN_OR_RETURN(const std::unique_ptr<StreamCodec> codec, row->make(recording.shape));
  DecodedStrands decoded;
  decoded.codec = name;
  decoded.bound_m = bound_m;
  const size_t count = recording.frames.size() - 1;
  double bytes = 0.0;
  for (size_t i = 0; i < count; ++i) {
    RETURN_IF_ERROR(codec->take(recording.frames[i]));
    ASSIGN_OR_RETURN(const std::vector<std::byte> message, codec->encode());
    RETURN_IF_ERROR(codec->decode(message));
    if (i >= kStartFrames) bytes += static_cast<double>(message.size());
    if (std::binary_search(compared.begin(), compared.end(), i))
      decoded.position_m.push_back(codec->decoded());
  }
  decoded.mbit_per_s = stream_mbit_per_s(bytes, count - kStartFrames);
  return decoded;
}

/// Crops side by side, each pixel `scale` times as large.
Image side_by_side(const std::vector<Image>& pictures, const PictureCrop& crop, uint32_t scale) {
  const uint32_t side = crop.side * scale;
  Image sheet;
  sheet.width = static_cast<uint32_t>(pictures.size()) * side;
  sheet.height = side;
  sheet.rgba.resize(size_t{sheet.width} * sheet.height * 4);
  for (size_t k = 0; k < pictures.size(); ++k)
    for (uint32_t y = 0; y < side; ++y)
      for (uint32_t x = 0; x < side; ++x) {
        const size_t from = size_t{crop.top + y / scale} * pictures[k].width + crop.left + x / scale;
        const size_t to = size_t{y} * sheet.width + k * side + x;
        std::copy_n(pictures[k].rgba.begin() + static_cast<ptrdiff_t>(4 * from), 4,
                    sheet.rgba.begin() + static_cast<ptrdiff_t>(4 * to));
      }
  return sheet;
}

/// Difference of two pictures, enlarged; grey where they are the same.
Image difference_of(const Image& seen, const Image& truth) {
  constexpr int kGrey = 128;
  Image difference = truth;
  for (size_t i = 0; i < truth.rgba.size(); ++i)
    if (i % 4 != 3)
      difference.rgba[i] =
          static_cast<uint8_t>(std::clamp(kGrey + kSheetGain * (seen.rgba[i] - truth.rgba[i]), 0, 255));
  return difference;
}

/// Compares pictures from one distance.
class ViewRun {
 public:
  ViewRun(ViewPainter& painter, const StreamRecording& recording, const std::vector<size_t>& compared,
          double distance_m)
      : painter_(painter), recording_(recording), compared_(compared), distance_m_(distance_m) {}

  /// Pictures of the floats, of all frames.
  Status draw_truth() {
    for (size_t i = 0; i < recording_.frames.size(); ++i) {
      const StreamFrame& frame = recording_.frames[i];
      const PosedStrands strands{frame.published.world_from_head, frame.position_in_head_m};
      if (std::binary_search(compared_.begin(), compared_.end(), i)) {
        ASSIGN_OR_RETURN(HairPicture truth, painter_.hair(strands, distance_m_));
        truth_.push_back(std::move(truth.image));
        mask_.push_back(std::move(truth.hair));
      } else {
        ASSIGN_OR_RETURN(Image truth, painter_.image(strands, distance_m_));
        truth_.push_back(std::move(truth));
      }
    }
    return {};
  }

  Result<StreamViewRow> compare(const DecodedStrands& decoded) {
    StreamViewRow row;
    row.codec = decoded.codec;
    row.distance_m = distance_m_;
    row.bound_m = decoded.bound_m;
    row.mbit_per_s = decoded.mbit_per_s;
    const double share = 1.0 / static_cast<double>(compared_.size());
    for (size_t k = 0; k < compared_.size(); ++k) {
      const Pose& world_from_head = recording_.frames[compared_[k]].published.world_from_head;
      ASSIGN_OR_RETURN(HairPicture seen,
                       painter_.hair({world_from_head, decoded.position_m[k]}, distance_m_));
      const PictureMask mask = either(mask_[k], seen.hair);
      ASSIGN_OR_RETURN(const PictureError error, picture_error(seen.image, truth_[compared_[k]], mask));
      row.psnr_db += share * error.psnr_db;
      row.ssim += share * error.ssim;
      row.delta_e += share * error.delta_e;
      row.hair_share += share * error.masked_share;
      const bool is_shown = std::find(std::begin(kSheetBoundsM), std::end(kSheetBoundsM), decoded.bound_m) !=
                            std::end(kSheetBoundsM);
      if (k == 0 && is_shown && decoded.codec == kViewCodecs[0]) shown_.push_back(std::move(seen.image));
    }
    return row;
  }

  ViewSheet sheet(RenderSize size) const {
    const Image& truth = truth_[compared_.front()];
    std::vector<Image> pictures = {truth};
    pictures.insert(pictures.end(), shown_.begin(), shown_.end());
    pictures.push_back(difference_of(shown_.front(), truth));
    // About as much as the hair's pixels would fill, from afar with larger pixels.
    const PictureMask& hair = mask_.front();
    const auto hair_pixels = static_cast<double>(std::count(hair.begin(), hair.end(), uint8_t{1}));
    const auto side = std::clamp(static_cast<uint32_t>(2.0 * std::sqrt(hair_pixels)), 1u, kSheetSide);
    const PictureCrop crop = fullest_crop(hair, size, side);
    const uint32_t scale = std::max(1u, kSheetSide / crop.side);
    return {distance_m_,
            fmt::format("From {:g} m{}: exact; {:g} mm; {:g} mm; {} times how far {:g} mm is from exact.",
                        distance_m_, scale > 1 ? fmt::format(", pixels {} times as large", scale) : "",
                        1e3 * kSheetBoundsM[0], 1e3 * kSheetBoundsM[1], kSheetGain, 1e3 * kSheetBoundsM[0]),
            side_by_side(pictures, crop, scale)};
  }

  PixelClip clip() const { return {distance_m_, &truth_, &compared_, &mask_}; }

 private:
  ViewPainter& painter_;
  const StreamRecording& recording_;
  const std::vector<size_t>& compared_;
  double distance_m_;
  std::vector<Image> truth_;       // of all frames
  std::vector<PictureMask> mask_;  // of the compared ones
  std::vector<Image> shown_;       // of the first compared one, at kSheetBoundsM
};

}  // namespace

PictureCrop fullest_crop(const std::vector<uint8_t>& mask, RenderSize size, uint32_t side) {
  CHECK(mask.size() == size_t{size.width} * size.height);
  side = std::min({side, size.width, size.height});
  // Of all pixels above and to the left.
  const size_t row = size_t{size.width} + 1;
  std::vector<uint32_t> sum(row * (size_t{size.height} + 1));
  for (size_t y = 0; y < size.height; ++y)
    for (size_t x = 0; x < size.width; ++x)
      sum[(y + 1) * row + x + 1] = sum[y * row + x + 1] + sum[(y + 1) * row + x] - sum[y * row + x] +
                                   (mask[y * size.width + x] != 0 ? 1 : 0);
  PictureCrop best{0, 0, side};
  uint32_t most = 0;
  for (uint32_t y = 0; y + side <= size.height; ++y)
    for (uint32_t x = 0; x + side <= size.width; ++x) {
      const uint32_t count = sum[(size_t{y} + side) * row + x + side] - sum[size_t{y} * row + x + side] -
                             sum[(size_t{y} + side) * row + x] + sum[size_t{y} * row + x];
      if (count <= most) continue;
      most = count;
      best = {x, y, side};
    }
  return best;
}

uint32_t view_step_count() {
  return static_cast<uint32_t>(std::size(kViewDistancesM)) *
         (1 + static_cast<uint32_t>(std::size(kViewCodecs) * std::size(kViewBoundsM)) + pixel_step_count());
}

Result<StreamView> measure_view(const StreamViewDesc& desc, const SceneDesc& scene,
                                const StreamRecording& recording,
                                const std::function<void(const std::string& doing)>& on_progress) {
  const std::vector<size_t> compared = compared_frames(recording.frames.size(), desc.compared_pictures);
  StreamView view;
  view.motion = recording.motion_name;
  view.strands = {recording.shape.strand_count, recording.shape.vertex_count};
  view.size = desc.size;
  view.compared_pictures = compared.size();
  view.missing = missing_picture_codecs();
  std::vector<DecodedStrands> streams;
  for (const char* codec : kViewCodecs)
    for (const double bound_m : kViewBoundsM) {
      ASSIGN_OR_RETURN(DecodedStrands decoded, decode_at(codec, bound_m, recording, compared));
      streams.push_back(std::move(decoded));
    }
  ASSIGN_OR_RETURN(const auto painter, ViewPainter::make(scene, desc.size));
  for (const double distance_m : kViewDistancesM) {
    ViewRun run(*painter, recording, compared, distance_m);
    on_progress(fmt::format("pictures of exact strands from {:g} m", distance_m));
    RETURN_IF_ERROR(run.draw_truth());
    if (view.drawn_strands == 0) view.drawn_strands = painter->drawn_strands();
    for (const DecodedStrands& decoded : streams) {
      on_progress(fmt::format("pictures of {} at {:g} mm from {:g} m", decoded.codec, 1e3 * decoded.bound_m,
                              distance_m));
      ASSIGN_OR_RETURN(const StreamViewRow row, run.compare(decoded));
      view.rows.push_back(row);
    }
    view.sheets.push_back(run.sheet(desc.size));
    ASSIGN_OR_RETURN(const std::vector<PixelPoint> points, measure_pixels(run.clip(), on_progress));
    view.pixels.insert(view.pixels.end(), points.begin(), points.end());
  }
  return view;
}

}  // namespace strandcast
