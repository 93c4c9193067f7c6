#include "server/app/mode_facts.h"

namespace strandcast {

ModeFacts gather_mode_facts(const ModeSources& sources) {
  ModeFacts facts;
  const std::vector<double>& bytes_per_s = sources.link.strand_bytes_per_s;
  for (size_t i = 0; i < sources.strand_classes.size(); ++i)
    facts.strand_classes.push_back(
        {i < bytes_per_s.size() ? bytes_per_s[i] : 0.0, sources.strand_classes[i].frame_rate_hz});
  facts.strand_decode_ms = sources.report.decode_ms;
  facts.strand_draw_ms = sources.report.draw_ms;
  facts.picture_decode_ms = sources.report.picture_decode_ms;
  facts.device = sources.report.device;

  const auto pixels =
      static_cast<double>(sources.picture_size.width) * static_cast<double>(sources.picture_size.height);
  const FrameCounters& pictures = sources.pictures;
  const bool is_measured = pictures.frames > 0;
  const double guessed_ms = sources.is_software ? kGuessedSoftwareMsPerPixel * pixels : kGuessedHardwareMs;
  const double one_ms = is_measured ? pictures.paint_median_ms + pictures.encode_median_ms : guessed_ms;
  facts.paint_ms = one_ms * static_cast<double>(sources.view_count);
  facts.is_paint_guessed = !is_measured && sources.is_software;
  facts.picture_bytes = is_measured
                            ? static_cast<double>(pictures.bytes) / static_cast<double>(pictures.frames)
                            : kGuessedBytesPerPixel * pixels;
  facts.picture_rate_hz = sources.picture_rate_hz;
  facts.paint_trouble = sources.paint_trouble;

  facts.capacity_bytes_per_s = sources.link.capacity_bytes_per_s;
  facts.round_trip_ms = sources.link.round_trip_ms;
  return facts;
}

}  // namespace strandcast
