#include "client/app/view_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/file.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

class Builder {
 public:
  void number(const char* key, double value, int decimals) {
    report_.push_back({key, std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "0", true});
  }
  void count(const char* key, uint64_t value) { report_.push_back({key, std::to_string(value), true}); }
  void word(const char* key, const std::string& value) { report_.push_back({key, value, false}); }
  ViewReport take() { return std::move(report_); }

 private:
  ViewReport report_;
};

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string find(const ViewReport& report, const std::string& key) {
  const auto entry = std::find_if(report.begin(), report.end(), [&](const auto& e) { return e.key == key; });
  return entry == report.end() ? "?" : entry->text;
}

}  // namespace

ReportScope scope_of(const LiveConnection& live) {
  return {live.earlier(), live.reconnects(), live.outage_s(), live.since_first_s()};
}

ViewReport make_report(ViewerSession& session, const ReportScope& scope) {
  constexpr double kP99 = 0.99;
  const Welcome& welcome = session.welcome();
  SessionTotals all = scope.earlier;
  all += totals_of(session);
  const ClockOffset clock = session.client().clock();
  const ServerStatus& server = session.status();
  const bool is_frames = session.mode() == StreamMode::Frames;
  const auto received_bytes = static_cast<double>(all.received_bytes);
  const StageTimer& decode = is_frames ? session.picture_decode_timer() : session.replay().decode_timer();
  const StageTimer& motion = session.motion_latency_timer();
  const double seconds = scope.whole_s.value_or(session.connected_s());

  Builder out;
  out.word("mode", to_string(session.mode()));
  out.word("mode_reason", session.mode_reason());
  out.count("mode_changes", all.mode_changes);
  out.count("blank_pictures", all.blank_pictures);
  out.word("scene", welcome.scene_name);
  out.word("sim_device", welcome.sim_device.empty() ? "unknown" : welcome.sim_device);
  out.word("hair_color", session.look().look.hair_color);
  out.count("look_changes", all.look_changes);
  const FrameQuality quality = session.frame_quality().value_or(FrameQuality{});
  out.word("codec", is_frames ? to_string(quality.codec) : welcome.codec);
  out.word("codec_reason", is_frames ? quality.reason : welcome.codec_reason);
  out.count("strands", welcome.strand_count);
  out.count("vertices_per_strand", welcome.vertex_count);
  out.number("bound_mm", static_cast<double>(welcome.bound_m) * 1e3, 3);
  out.number("seconds", seconds, 2);
  out.count("reconnects", scope.reconnects);
  out.number("outage_s", scope.outage_s, 2);
  out.count("decoded_frames", all.decoded_frames);
  out.number("frames_per_s", static_cast<double>(all.decoded_frames) / seconds, 2);
  out.number("bytes_per_frame",
             received_bytes / static_cast<double>(std::max<uint64_t>(all.received_frames, 1)), 0);
  out.number("mbit_per_s", received_bytes * kBitsPerByte * 1e-6 / seconds, 3);
  out.number("decode_ms_median", decode.median_ms(), 3);
  out.number("decode_ms_p99", decode.quantile_ms(kP99), 3);
  out.number("render_ms_median", 0.0, 3);
  out.count("rendered_pictures", 0);
  out.word("interpolation", to_string(Interpolation::None));
  out.count("linear_pictures", 0);
  out.count("cubic_pictures", 0);
  out.number("motion_to_decoded_ms_median", motion.median_ms(), 3);
  out.number("motion_to_decoded_ms_p99", motion.quantile_ms(kP99), 3);
  out.count("motion_samples_seen", all.motion_samples);
  out.number("clock_error_ms", clock.has_value() ? static_cast<double>(clock.error_ns()) * 1e-6 : 0.0, 3);
  out.count("keyframes", all.keyframes);
  out.count("gaps", all.gaps);
  out.count("missed_frames", all.missed_frames);
  out.count("rejected_frames", all.rejected_frames);
  out.count("keyframe_requests", all.keyframe_requests);
  out.count("dropped_by_client", all.dropped_by_client);
  out.count("dropped_by_server", all.dropped_by_server);
  out.number("strand_share", session.quality().strand_share, 3);
  out.count("rate_divisor", session.quality().rate_divisor);
  out.number("quality_bound_mm", static_cast<double>(session.quality().bound_m) * 1e3, 3);
  out.count("quality_changes", all.quality_changes);
  out.count("picture_width", quality.width);
  out.count("picture_height", quality.height);
  out.count("picture_quality", quality.quality);
  out.number("picture_rate_hz", quality.rate_hz, 2);
  out.count("whole_pictures", all.whole_pictures);
  const auto told = [&](const char* key, double value, int digits) {
    session.has_status() ? out.number(key, value, digits) : out.word(key, "unknown");
  };
  told("queue_delay_ms", server.queue_delay_ms, 1);
  told("server_sim_ms", server.sim_ms, 3);
  told("server_encode_ms", server.encode_ms, 3);
  told("server_render_ms", server.render_ms, 3);
  told("server_realtime_factor", server.realtime_factor, 3);
  out.word("server_slow_motion", session.last_slow_motion().empty() ? "none" : session.last_slow_motion());
  out.count("server_tick", server.tick);
  return out.take();
}

void set_mode_reason(ViewReport& report, const std::string& reason) {
  for (ReportEntry& entry : report)
    if (entry.key == "mode_reason") entry.text = reason;
}

void set_render_times(ViewReport& report, const StageTimer& render_timer) {
  for (ReportEntry& entry : report) {
    if (entry.key == "render_ms_median") entry.text = fmt::format("{:.3f}", render_timer.median_ms());
    if (entry.key == "rendered_pictures") entry.text = std::to_string(render_timer.count());
  }
}

void set_interpolation(ViewReport& report, uint64_t linear_count, uint64_t cubic_count) {
  const Interpolation most = cubic_count > linear_count ? Interpolation::Cubic
                             : linear_count > 0         ? Interpolation::Linear
                                                        : Interpolation::None;
  for (ReportEntry& entry : report) {
    if (entry.key == "interpolation") entry.text = to_string(most);
    if (entry.key == "linear_pictures") entry.text = std::to_string(linear_count);
    if (entry.key == "cubic_pictures") entry.text = std::to_string(cubic_count);
  }
}

void add_answer_times(ViewReport& report, const StageTimer& answer_timer) {
  constexpr double kP99 = 0.99;
  Builder out;
  out.number("answer_ms_median", answer_timer.median_ms(), 3);
  out.number("answer_ms_p99", answer_timer.quantile_ms(kP99), 3);
  for (ReportEntry& entry : out.take()) report.push_back(std::move(entry));
}

std::string to_lines(const ViewReport& report) {
  std::string text;
  for (const auto& entry : report) text += fmt::format("{}={}\n", entry.key, entry.text);
  return text;
}

std::string to_json(const ViewReport& report) {
  std::string text = "{\n";
  for (size_t i = 0; i < report.size(); ++i) {
    const auto& entry = report[i];
    text += fmt::format("  {}: {}{}\n", quoted(entry.key), entry.is_number ? entry.text : quoted(entry.text),
                        i + 1 < report.size() ? "," : "");
  }
  return text + "}\n";
}

Status save_report(const std::filesystem::path& path, const ViewReport& report) {
  const std::string text = path.extension() == ".json" ? to_json(report) : to_lines(report);
  return save_file(path, std::as_bytes(std::span(text)));
}

std::string to_summary(const ViewReport& report) {
  const auto v = [&](const char* key) { return find(report, key); };
  const std::string dropped = fmt::format("{} by the server, {} missed, {} by this viewer",
                                          v("dropped_by_server"), v("missed_frames"), v("dropped_by_client"));
  const std::string slow = v("server_slow_motion");
  const bool was_away = v("reconnects") != "0" || v("outage_s") != "0.00";
  const std::string motion =
      v("motion_samples_seen") == "0"
          ? std::string("no head motion came")
          : fmt::format("{} ms median, {} ms p99 ({} samples, clock +-{} ms)",
                        v("motion_to_decoded_ms_median"), v("motion_to_decoded_ms_p99"),
                        v("motion_samples_seen"), v("clock_error_ms"));
  const std::string outage = was_away
                                 ? fmt::format("  connection      found again {} times, {} s without one\n",
                                               v("reconnects"), v("outage_s"))
                                 : std::string();
  const std::string server = v("server_sim_ms") == "unknown"
                                 ? std::string("has not said how fast it is")
                                 : fmt::format("{} ms per step, realtime factor {}", v("server_sim_ms"),
                                               v("server_realtime_factor"));
  return fmt::format(
      "scene {} ({} strands x {}), {} by {}\n"
      "  mode            {}\n"
      "  decoded         {} frames in {} s ({} per second), {} bytes per frame, {} Mbit/s\n"
      "  decode          {} ms (p99 {} ms)\n"
      "  render          {} ms ({} frames)\n"
      "  motion->decoded {}\n"
      "  dropped         {}\n"
      "  server          {}\n{}{}",
      v("scene"), v("strands"), v("vertices_per_strand"), v("mode"), v("codec"), v("mode_reason"),
      v("decoded_frames"), v("seconds"), v("frames_per_s"), v("bytes_per_frame"), v("mbit_per_s"),
      v("decode_ms_median"), v("decode_ms_p99"), v("render_ms_median"), v("rendered_pictures"), motion,
      dropped, server, outage, slow == "none" || slow == "?" ? std::string() : fmt::format("  {}\n", slow));
}

}  // namespace strandcast
