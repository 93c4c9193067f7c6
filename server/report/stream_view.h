// StreamView: measures what a viewer sees of a stream of strands. Pictures drawn from decoded strands are
// compared with those drawn from exact floats, in the pixels of the hair, near and far. Coded pictures of the
// exact floats are compared too, which gives the bit rate of both kinds of streaming at equal quality. Drawn
// in tiles on the processors.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/picture_size.h"
#include "common/pictures/image_codec.h"
#include "common/scene/scene_desc.h"
#include "server/report/stream_recording.h"

namespace strandcast {

/// Distances of the camera from its target: that of the built-in scene, and hair across a room.
inline constexpr double kViewDistancesM[] = {0.66, 3.0};
inline constexpr double kViewBoundsM[] = {2e-5, 5e-5, 1e-4, 2e-4, 5e-4};
/// Codecs of the strands; "step" knows all of the wind.
inline constexpr const char* kViewCodecs[] = {"tangent", "step"};

struct StreamViewDesc {
  RenderSize size{1280, 720};
  size_t compared_pictures = 4;  // evenly spaced after the first kStartFrames
};

/// Pictures of decoded strands compared with those of the floats: means over the compared pictures.
struct StreamViewRow {
  std::string codec;  // of kViewCodecs
  double distance_m = 0.0;
  double bound_m = 0.0;
  double psnr_db = 0.0;
  double ssim = 0.0;
  double delta_e = 0.0;
  double hair_share = 0.0;  // of the picture
  double mbit_per_s = 0.0;  // of the strands, at 60 Hz
};

/// Coded pictures of the exact floats at 60 Hz, at one setting of a picture codec.
struct PixelPoint {
  double distance_m = 0.0;
  std::string codec;    // as to_string(PictureCodec)
  std::string setting;  // "quality 80", "20 Mbit/s asked for"
  double mbit_per_s = 0.0;
  double psnr_db = 0.0;
  double ssim = 0.0;
};

/// Hair of one picture: exact, at two bounds, and the error of the finer one.
struct ViewSheet {
  double distance_m = 0.0;
  std::string caption;
  Image image;
};

struct StreamView {
  std::string motion;
  StreamSize strands;
  uint64_t drawn_strands = 0;  // with followers, in the last near picture
  RenderSize size;
  size_t compared_pictures = 0;
  std::vector<StreamViewRow> rows;
  std::vector<PixelPoint> pixels;
  std::vector<std::string> missing;  // picture codecs that this build does not have
  std::vector<ViewSheet> sheets;
};

/// Returns how often measure_view() reports progress, at most.
uint32_t view_step_count();
/// Measures a recording of the scene's strands.
Result<StreamView> measure_view(const StreamViewDesc& desc, const SceneDesc& scene,
                                const StreamRecording& recording,
                                const std::function<void(const std::string& doing)>& on_progress);

/// Measure of equal quality. PSNR uses red, green and blue, whose colour picture codecs store at half the
/// size; SSIM uses brightness alone.
enum class LookMeasure { Psnr, Ssim };
/// Returns a quality in dB; for SSIM, that of its distance from 1.
double look_db(const PixelPoint& point, LookMeasure measure);
double look_db(const StreamViewRow& row, LookMeasure measure);

/// Returns the Mbit/s at which a codec's pictures reach a quality, interpolated between settings linearly in
/// dB over the logarithm of the rate. Empty if no setting reaches it; the least rate if all do.
std::optional<double> mbit_per_s_for(const std::vector<PixelPoint>& pixels, const std::string& codec,
                                     double distance_m, LookMeasure measure, double wanted_db);
/// Returns the PSNR of a codec's pictures at this rate. Empty below the least measured rate; the best value
/// above all.
std::optional<double> psnr_db_at(const std::vector<PixelPoint>& pixels, const std::string& codec,
                                 double distance_m, double mbit_per_s);

/// The square of `side` pixels in the picture that contains most of the mask; smaller if the picture is.
struct PictureCrop {
  uint32_t left = 0, top = 0, side = 0;
};
PictureCrop fullest_crop(const std::vector<uint8_t>& mask, RenderSize size, uint32_t side);

}  // namespace strandcast
