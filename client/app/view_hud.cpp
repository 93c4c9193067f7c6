#include "client/app/view_hud.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace strandcast {
namespace {

constexpr int64_t kRateWindowNs = 2'000'000'000;
constexpr double kNsToMs = 1e-6;
constexpr double kFewPerS = 9.5;       // below, tenths say more
constexpr size_t kMaxSceneChars = 24;  // of the title

bool shows_frames(const ViewerState& now) {
  return now.mode.shown == StreamMode::Frames;
}

/// While there is no connection.
std::optional<HudBanner> banner(const ViewerState& now, const ViewFacts& facts) {
  if (now.is_connected) return std::nullopt;
  HudBanner banner;
  const std::string where = facts.address.to_string();
  // The headline says where.
  banner.trouble = now.trouble.starts_with(where + ": ") ? now.trouble.substr(where.size() + 2) : now.trouble;
  banner.help = now.help;
  if (facts.is_starting) {
    banner.headline = "starting";
    banner.doing = "looking for what draws";
  } else if (now.final_error) {
    banner.headline = "no connection to " + where;
    banner.doing = "Esc quits";
  } else {
    banner.headline = (now.session_number > 0 ? "connection lost: connecting to " : "connecting to ") + where;
    banner.doing = now.doing + "   (Esc quits)";
  }
  return banner;
}

std::string how_drawn(size_t step) {
  const DrawStep& drawn = kDrawSteps[step];
  if (step == 0) return "whole";
  std::string text = fmt::format("{:.0f} % of the sides", drawn.size_share * 1e2);
  if (drawn.strand_share < 1.0) text += fmt::format(", {:.0f} % of the strands", drawn.strand_share * 1e2);
  return text + ", until all stands still";
}

/// Passes that run, without their folder, in ms.
std::string passes_text(const gl::PassReports& passes) {
  std::string text;
  for (const gl::PassReport& pass : passes) {
    if (pass.fate != gl::PassFate::Kept || pass.median_ms <= 0.0) continue;
    const size_t slash = pass.name.find('/');
    text += fmt::format("{}{} {:.1f}", text.empty() ? "" : ", ",
                        slash == std::string::npos ? pass.name : pass.name.substr(slash + 1), pass.median_ms);
  }
  return text + " ms";
}

/// Whose look is seen.
std::string look_text(const ViewerState& now, const ViewFacts& facts) {
  if (facts.has_own_look && !shows_frames(now)) return "your own, seen here alone (L)";
  const std::string& color = now.look.look.hair_color;
  if (now.look_changes == 0) return color + " (L)";
  return fmt::format("{}, changed {} time{} (L)", color, now.look_changes, now.look_changes == 1 ? "" : "s");
}

std::string shortened(const std::string& name) {
  return name.size() <= kMaxSceneChars ? name : name.substr(0, kMaxSceneChars) + "...";
}

/// The heads that are drawn.
std::string shown_name(const ViewerState& now, const ViewFacts& facts) {
  return facts.heads.empty() ? now.welcome.scene_name : fmt::format("{}", fmt::join(facts.heads, ", "));
}

}  // namespace

void Rate::update(uint64_t total, int64_t time_ns) {
  if (begin_ns_ != 0 && total >= begin_total_) {
    if (time_ns - begin_ns_ < kRateWindowNs) return;
    per_s_ = static_cast<double>(total - begin_total_) * 1e9 / static_cast<double>(time_ns - begin_ns_);
  } else {
    per_s_ = 0.0;
  }
  begin_total_ = total;
  begin_ns_ = time_ns;
}

HudState HudWriter::write(const ViewerState& now, const ViewFacts& facts, int64_t time_ns) {
  shown_.update(facts.shown_count, time_ns);
  bytes_.update(now.net.received_bytes, time_ns);
  received_.update(now.decoded_frames, time_ns);
  HudState hud;
  hud.banner = banner(now, facts);
  hud.warnings = warnings(now, facts, time_ns);
  if (now.session_number == 0) {
    hud.title = "strandcast";
    return hud;
  }
  const double rate = shown_.per_s();
  hud.title = fmt::format(
      "{}: {}, {}", shortened(shown_name(now, facts)), shows_frames(now) ? "server's pictures" : "strands",
      rate > 0.0 ? fmt::format("{:.{}f} pictures/s", rate, rate < kFewPerS ? 1 : 0) : "nothing moves");
  hud.rows = rows(now, facts, time_ns);
  for (const WayPart& part : facts.way) hud.way.push_back({part.name, part.median_ms});
  return hud;
}

std::vector<std::string> HudWriter::warnings(const ViewerState& now, const ViewFacts& facts,
                                             int64_t time_ns) {
  std::vector<std::string> all;
  const double factor = now.status.realtime_factor;
  const bool is_slow =
      now.has_status && now.is_connected && !now.status.is_paused && factor > 0.0 && factor < kSlowMotion;
  if (!is_slow) real_time_ns_ = time_ns;
  if (now.has_status && now.status.is_paused) all.emplace_back("paused: Space resumes, N steps");
  const std::string of_head = facts.heads.empty() ? std::string() : now.welcome.scene_name + ": ";
  if (now.has_status && now.status.is_motion_stale)
    all.push_back(of_head + "no head motion arrives at the server");
  for (const std::string& head : facts.stale_heads)
    all.push_back(head + ": no head motion arrives at the server");
  // The server knows what helps; older ones leave it at that.
  if (now.is_connected && !now.status.slow_motion.empty())
    all.push_back(now.status.slow_motion);
  else if (time_ns - real_time_ns_ >= kSlowMotionNs)
    all.push_back(
        fmt::format("slow motion: x{:.2f} of real time; fewer strands or a cheaper solver help", factor));
  if (now.has_status && !now.status.recording.empty()) all.push_back("recording " + now.status.recording);
  if (!facts.message.empty()) all.push_back(facts.message);
  return all;
}

std::vector<HudRow> HudWriter::rows(const ViewerState& now, const ViewFacts& facts, int64_t time_ns) const {
  const bool is_frames = shows_frames(now);
  std::vector<HudRow> all;
  const auto add = [&](const char* label, std::string value) { all.push_back({label, std::move(value)}); };
  add("server", facts.address.to_string());
  if (!facts.heads.empty()) add("heads", shown_name(now, facts));
  add("scene", fmt::format("{}, {} strands x {}", now.welcome.scene_name, now.welcome.strand_count,
                           now.welcome.vertex_count));
  add("look", look_text(now, facts));
  add("asked for", now.mode.wish());
  const std::string& reason = facts.own_reason.empty() ? now.mode.reason : facts.own_reason;
  if (!reason.empty()) add("because", reason);
  if (!is_frames) {
    add("strands by", codec_text(now.welcome));
    if (now.exact_share > 0.0) add("exact", fmt::format("{:.1f} % of the frames", 1e2 * now.exact_share));
    add("shows", facts.playout == Playout::Smooth ? "smooth playout" : "the newest state");
    if (facts.playout == Playout::Smooth) add("interpolation", to_string(facts.interpolation));
    add("drawn", fmt::format("{} ({:.0f} ms)", how_drawn(facts.draw_step), facts.draw_ms));
    if (!facts.drawn_by.empty()) add("by", facts.drawn_by);
    if (!facts.passes.empty()) add("passes", passes_text(facts.passes));
    if (facts.profile.drawn_strands > 0)
      add("renderer",
          fmt::format("{} strands, {} segments, {:.1f} MB", facts.profile.drawn_strands,
                      facts.profile.drawn_segments, static_cast<double>(facts.renderer_bytes) * 1e-6));
    if (const std::string lack = left_out_text(facts.profile); !lack.empty()) add("left out", lack);
    if (facts.debug_view != DebugView::None)
      add("view", fmt::format("{} (V: the next)", name_of(facts.debug_view)));
    if (now.quality_changes > 0)
      add("stream of",
          fmt::format("{:.3g} % of the strands every {} steps within {:.2g} mm",
                      now.quality.strand_share * 1e2, now.quality.rate_divisor, now.quality.bound_m * 1e3));
  }
  add("received", fmt::format("{:.1f} kB/s, {:.0f} frames/s", bytes_.per_s() * 1e-3, received_.per_s()));
  add("decoded in", fmt::format("{:.2f} ms", is_frames ? now.picture_decode_ms : now.strand_decode_ms));
  add("server step",
      fmt::format("{:.2f} ms, x{:.2f} real time", now.status.sim_ms, now.status.realtime_factor));
  if (!now.welcome.sim_device.empty()) add("simulated by", now.welcome.sim_device);
  if (!now.status.detail.empty()) add("simulates", now.status.detail);
  add("encoded in", fmt::format("{:.2f} ms", now.status.encode_ms));
  const double since_ms = static_cast<double>(time_ns - now.made_ns) * kNsToMs;
  if (now.state_age_ms > 0.0) add("state age", fmt::format("{:.0f} ms", now.state_age_ms + since_ms));
  if (now.motion_to_decoded_ms > 0.0) {
    std::string late = fmt::format("{:.0f} ms decoded", now.motion_to_decoded_ms);
    if (!is_frames) late += fmt::format(" + {:.0f} ms drawn", facts.draw_ms);
    if (!is_frames && facts.playout == Playout::Smooth)
      late += fmt::format(" + {:.0f} ms smooth", now.playout_delay_ms);
    add("from motion", late);
  }
  add("round trip", fmt::format("{:.1f} ms, {:.0f} ms queued", now.round_trip_ms, now.status.queue_delay_ms));
  add("dropped", fmt::format("{} server, {} missed, {} here", now.status.dropped_frames, now.missed_frames,
                             now.net.dropped_frames));
  add("window", fmt::format("answers in {:.0f} ms", facts.answer_ms));
  if (now.status.timecode)
    add("timecode", fmt::format("{} at {} fps", timecode_text(*now.status.timecode),
                                frame_rate_text(now.status.timecode->rate.hz())));
  add("tick", fmt::format("{}, {} viewer{}", now.status.tick, now.status.viewer_count,
                          now.status.viewer_count == 1 ? "" : "s"));
  return all;
}

}  // namespace strandcast
