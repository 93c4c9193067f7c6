#include "server/report/streaming_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/units.h"
#include "common/plot/svg_plot.h"
#include "server/report/html_page.h"
#include "server/report/peers/peer_codecs.h"
#include "server/report/report_files.h"
#include "server/report/stream_view_page.h"
#include "server/report/streaming_goals.h"
#include "server/report/svg_bars.h"

namespace strandcast {
namespace {

// The place of a name is its style in all plots.
constexpr std::array kCodecStyles = {"tangent",
                                     "meshopt+zstd temporal",
                                     "draco temporal",
                                     "delta",
                                     "step, wind known",
                                     "step, wind mean",
                                     "step, wind unknown",
                                     "zfp temporal",
                                     "zstd 16 bit temporal",
                                     "raw",
                                     "zstd float",
                                     "meshopt+zstd",
                                     "draco",
                                     "zfp",
                                     "zstd 16 bit"};

size_t style_of(const std::string& codec) {
  const auto* found = std::find(kCodecStyles.begin(), kCodecStyles.end(), codec);
  return static_cast<size_t>(found - kCodecStyles.begin());
}

/// The recording that plots of one recording are of: walking and turning where there is any.
const StreamingRow* shown_recording(const StreamingReport& report) {
  for (const StreamingRow& row : report.rows)
    if (row.solver == report.solver && row.motion_level == MotionLevel::Active &&
        row.part == MotionPart::Median)
      return &row;
  return report.rows.empty() ? nullptr : &report.rows.front();
}

std::string recording_words(const StreamingRow& row) {
  return fmt::format("{} ({}), {} vertices", row.motion_and_part(), to_string(row.motion_level),
                     to_string(row.size));
}

/// The names of a report's codecs, in the order of kCodecStyles.
std::vector<std::string> codec_names(const StreamingReport& report) {
  std::vector<std::string> names;
  for (const char* name : kCodecStyles)
    if (std::any_of(report.rows.begin(), report.rows.end(),
                    [&](const StreamingRow& row) { return row.codec_and_wind() == name; }))
      names.emplace_back(name);
  return names;
}

std::string row_note(const StreamingRow& row) {
  return fmt::format(
      "{}, bound {:g} mm: {:.2f} bits per vertex, largest error {:.4f} mm, encode {:.1f} ms, "
      "decode {:.1f} ms",
      row.codec_and_wind(), kMmPerM * row.bound_m, row.bits, kMmPerM * row.max_error_m, row.encode_cpu_ms,
      row.decode_cpu_ms);
}

HtmlTable goal_table(const StreamingReport& report) {
  HtmlTable table;
  table.columns = {"goal, at 0.1 mm unless told otherwise", "measured", "verdict"};
  for (const GoalLine& line : judge_streaming(report)) {
    const HtmlMark mark = line.verdict == Verdict::Met      ? HtmlMark::Good
                          : line.verdict == Verdict::Missed ? HtmlMark::Bad
                                                            : HtmlMark::None;
    table.rows.push_back({line.goal, line.measured, {to_string(line.verdict), mark}});
  }
  return table;
}

HtmlTable recording_table(const StreamingReport& report) {
  HtmlTable table;
  table.columns = {"motion",
                   "part",
                   "class",
                   "strand model",
                   "hair, RMS m/s in head space",
                   "head, mean m/s",
                   "head turns, mean degrees/s",
                   "strands x vertices",
                   "frames of 1/60 s"};
  for (const StreamRecording& recording : report.recordings) {
    table.rows.push_back(
        {recording.motion_name, to_string(recording.part), to_string(recording.motion_level),
         recording.solver, fmt::format("{:.2f}", recording.hair_rms_mps),
         fmt::format("{:.2f}", recording.head.mean_speed_mps),
         fmt::format("{:.0f}", recording.head.mean_turn_rad_per_s * 180.0 / std::numbers::pi),
         to_string(StreamSize{recording.shape.strand_count, recording.shape.vertex_count}),
         fmt::format("{}", recording.step_ms.size())});
  }
  return table;
}

HtmlTable codec_table(const StreamingReport& report, const StreamRecording& recording) {
  const StreamSize size{recording.shape.strand_count, recording.shape.vertex_count};
  HtmlTable table;
  table.caption = fmt::format("{}, {} part, {}, {}, {}", recording.motion_name, to_string(recording.part),
                              to_string(recording.motion_level), recording.solver, to_string(size));
  table.columns = {"codec",
                   "bound, mm",
                   "bits/vertex",
                   "with start",
                   "keyframe",
                   "Mbit/s",
                   "max error, mm",
                   "RMS error, mm",
                   "encode, ms of one core",
                   "decode, ms of one core",
                   "encode, ms by the clock"};
  for (const StreamingRow& row : report.rows) {
    if (row.motion != recording.motion_name || row.solver != recording.solver || row.part != recording.part ||
        row.size.strand_count != size.strand_count || row.size.vertex_count != size.vertex_count)
      continue;
    const bool keeps = row.keeps_bound();
    table.rows.push_back(
        {row.codec_and_wind(),
         row.bound_m > 0.0 ? fmt::format("{:.3g}", kMmPerM * row.bound_m) : "lossless",
         fmt::format("{:.2f}", row.bits),
         fmt::format("{:.2f}", row.all_bits),
         fmt::format("{:.2f}", row.join_bits),
         fmt::format("{:.1f}", row.mbit_per_s()),
         {fmt::format("{:.4f}{}", kMmPerM * row.max_error_m, keeps ? "" : " misses the bound"),
          keeps ? HtmlMark::None : HtmlMark::Bad},
         fmt::format("{:.4f}", kMmPerM * row.rms_error_m),
         fmt::format("{:.2f}", row.encode_cpu_ms),
         fmt::format("{:.2f}", row.decode_cpu_ms),
         fmt::format("{:.2f}", row.encode_wall_ms)});
  }
  return table;
}

HtmlTable latency_table(const StreamLatency& latency) {
  HtmlTable table;
  table.caption =
      fmt::format("{}, {}, codec {} at {:g} mm, {:.0f} bytes per frame", latency.motion,
                  to_string(latency.size), latency.codec, kMmPerM * latency.bound_m, latency.bytes);
  table.columns = {"stage", "median, ms", "99th percentile, ms"};
  std::vector<LatencyStage> stages = latency.stages;
  stages.push_back(latency.total);
  for (const LatencyStage& stage : stages)
    table.rows.push_back(
        {stage.name, fmt::format("{:.2f}", stage.median_ms), fmt::format("{:.2f}", stage.p99_ms)});
  return table;
}

std::string method_text(const StreamingReport& report) {
  return fmt::format(
      "Strands are the built-in scene's, moved by {} (where nothing else is said) on {} at 60 Hz in its "
      "breeze; of each "
      "motion the wildest {:g} s and those that are the median of its parts, by its head, are kept as 32-bit "
      "floats in head space, and every codec gets the same frames. Errors are "
      "Euclidean, of every vertex of every frame, against those floats. Bits leave out the first {} frames "
      "(\"with start\" has them). Times are processor time of the whole process, the median over frames, on "
      "a "
      "machine with {} processors that may have had other work. What a codec of ours is given is rounded to "
      "its fine lattice before the clock starts, as publishing does on a server; peers round while it runs.",
      report.solver, report.device, report.seconds, kStartFrames, report.processors);
}

constexpr const char* kPeerText =
    "Peers get strands sorted along a Morton curve through their roots. meshoptimizer (vertex codec, then "
    "zstd "
    "3) and Draco (sequential point cloud) code integers on the coarsest cubic lattice that keeps the bound; "
    "zfp runs in accuracy mode on one array per axis with the largest power-of-two tolerance that keeps it, "
    "found outside its time. \"Temporal\" is a prediction in time around them: the last movement, its change "
    "and, on "
    "integers, what the parent vertex just did, with four weights fitted to each frame. It is less than what "
    "tangent predicts with. Integers lose nothing, so "
    "that chain is closed; zfp's is closed over decoded values. \"zstd 16 bit\" has a box of one metre and "
    "the "
    "error that follows from it; \"zstd float\" loses nothing. At bounds other than 0.1 mm peers run on the "
    "first motion of each class.";

std::string class_text() {
  return fmt::format(
      "A motion's class and parts follow from the head alone, so that they are the same with every strand "
      "model: "
      "its mean rate of turn times {:g} m plus its mean acceleration times {:g} s is the drive of a part; "
      "the "
      "median half second of what is idle has less than {:g} m/s, of walking and turning less than {:g} m/s, "
      "of "
      "violent motion more.",
      kDriveLengthM, kDriveLagS, kActiveDriveMps, kViolentDriveMps);
}

constexpr const char* kCaseText =
    "Plots and the goals of tangent are of the first strand model, those of step of the models that they "
    "name. A codec that predicts by steps of the strand model needs to know the wind: all of it, the wind at "
    "the head without the waves over the head, or nothing of it. It gets to know how strands move while it "
    "runs: half a second is mostly that, and longer parts (--seconds 2) take fewer bits.";

constexpr const char* kLatencyText =
    "From the motion sample that a step takes to the decoded frame, in one process, one stage after the "
    "other: "
    "the server's stages, TCP on loopback without the WebSocket framing, and a viewer's decoder. Not in it: "
    "how long a sample waits for the next step (0 to 16.7 ms at 60 Hz) and drawing, which strandcast-view "
    "measures (--report).";

}  // namespace

std::string streaming_csv(const StreamingReport& report) {
  CsvFile csv({"clip",
               "part",
               "class",
               "strands",
               "vertices",
               "codec",
               "kind",
               "bound_mm",
               "bits_per_vertex",
               "bits_per_vertex_with_start",
               "keyframe_bits_per_vertex",
               "mbit_per_s",
               "max_error_mm",
               "rms_error_mm",
               "keeps_bound",
               "encode_cpu_ms",
               "decode_cpu_ms",
               "encode_wall_ms",
               "decode_wall_ms",
               "moved_by",
               "solver",
               "wind_told"});
  for (const StreamingRow& row : report.rows) {
    csv.add_row({row.motion,
                 to_string(row.part),
                 to_string(row.motion_level),
                 fmt::format("{}", row.size.strand_count),
                 fmt::format("{}", row.size.vertex_count),
                 row.codec,
                 row.is_ours       ? "ours"
                 : row.is_temporal ? "peer, temporal"
                                   : "peer, positions",
                 csv_number(kMmPerM * row.bound_m),
                 csv_number(row.bits),
                 csv_number(row.all_bits),
                 csv_number(row.join_bits),
                 csv_number(row.mbit_per_s()),
                 csv_number(kMmPerM * row.max_error_m),
                 csv_number(kMmPerM * row.rms_error_m),
                 row.keeps_bound() ? "yes" : "no",
                 csv_number(row.encode_cpu_ms),
                 csv_number(row.decode_cpu_ms),
                 csv_number(row.encode_wall_ms),
                 csv_number(row.decode_wall_ms),
                 row.moved_by,
                 row.solver,
                 row.wind});
  }
  return csv.text();
}

std::string streaming_bound_plot(const StreamingReport& report) {
  PlotDesc desc;
  const StreamingRow* shown = shown_recording(report);
  desc.title = "Bits against error bound" + (shown != nullptr ? ": " + recording_words(*shown) : "");
  desc.x.title = "largest error allowed for any vertex, mm";
  desc.y.title = "bits per vertex and frame";
  for (const std::string& name : codec_names(report)) {
    PlotSeries series;
    series.name = name;
    series.style = static_cast<int>(style_of(name));
    for (const StreamingRow& row : report.rows)
      if (row.codec_and_wind() == name && row.is_same_recording(*shown) && !row.is_bound_free)
        series.points.push_back({kMmPerM * row.bound_m, row.bits, row_note(row)});
    if (!series.points.empty()) desc.series.push_back(std::move(series));
  }
  return make_svg_plot(desc);
}

std::string streaming_time_plot(const StreamingReport& report) {
  PlotDesc desc;
  const StreamingRow* shown = shown_recording(report);
  desc.title = "Bits against time at 0.1 mm" + (shown != nullptr ? ": " + recording_words(*shown) : "");
  desc.x.title = "encode and decode, ms of one core per frame";
  desc.y.title = "bits per vertex and frame";
  for (const std::string& name : codec_names(report)) {
    PlotSeries series;
    series.name = name;
    series.style = static_cast<int>(style_of(name));
    series.mark = PlotMark::Dots;
    for (const StreamingRow& row : report.rows)
      if (row.codec_and_wind() == name && row.is_same_recording(*shown) &&
          (row.is_bound_free || row.bound_m == kGoalBoundM))
        series.points.push_back({row.encode_cpu_ms + row.decode_cpu_ms, row.bits, row_note(row)});
    desc.series.push_back(std::move(series));
  }
  return make_svg_plot(desc);
}

std::string streaming_motion_plot(const StreamingReport& report) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  BarDesc desc;
  desc.y_title = "bits per vertex and frame";
  std::vector<BarSeries> ours;
  for (const std::string& name : codec_names(report))
    if (name == "tangent" || name == "delta" || name.starts_with("step"))
      ours.push_back({name, {}, style_of(name)});
  BarSeries temporal{"best peer, temporal", {}, style_of("meshopt+zstd temporal")};
  BarSeries plain{"best peer, positions", {}, style_of("meshopt+zstd")};
  const StreamingRow* first = report.rows.empty() ? nullptr : &report.rows.front();
  for (const StreamingRow& row : report.rows) {
    if (row.codec != "tangent" || row.bound_m != kGoalBoundM || row.solver != report.solver ||
        row.size.strand_count != first->size.strand_count ||
        row.size.vertex_count != first->size.vertex_count)
      continue;
    desc.groups.push_back(row.part == MotionPart::Median ? row.motion : "its wildest");
    for (BarSeries& series : ours) {
      const auto same =
          std::find_if(report.rows.begin(), report.rows.end(), [&](const StreamingRow& candidate) {
            return candidate.codec_and_wind() == series.name && candidate.bound_m == row.bound_m &&
                   candidate.is_same_recording(row);
          });
      series.value.push_back(same != report.rows.end() ? same->bits : kNone);
    }
    const StreamingRow* peer = best_peer(report, row, PeerKind::Temporal);
    temporal.value.push_back(peer != nullptr ? peer->bits : kNone);
    peer = best_peer(report, row, PeerKind::Plain);
    plain.value.push_back(peer != nullptr ? peer->bits : kNone);
  }
  desc.title = "Bits at 0.1 mm" + (first != nullptr ? ", " + to_string(first->size) + " vertices" : "");
  desc.series = std::move(ours);
  desc.series.push_back(std::move(temporal));
  desc.series.push_back(std::move(plain));
  return make_svg_bars(desc);
}

std::string streaming_page(const StreamingReport& report) {
  HtmlPage page("Streaming strands: what a viewer needs, and what it sees");
  page.answer(needs_text(report));
  page.table(needs_table(report));
  page.paragraph(
      "Exact frames are exact: viewers take the simulation's own steps and have its own numbers. All other "
      "codecs keep vertices within the bound.");
  page.table(reach_table(report));
  if (const std::string clips = clips_text(report); !clips.empty()) page.paragraph(clips);
  add_view_sections(page, report.view);
  add_playout_section(page, report.playout, report.playout_note);
  page.heading("Goals");
  const std::vector<GoalLine> goals = judge_streaming(report);
  const auto count = [&](Verdict verdict) {
    return std::count_if(goals.begin(), goals.end(),
                         [&](const GoalLine& line) { return line.verdict == verdict; });
  };
  page.paragraph(
      fmt::format("Of {} goals {} are met, {} missed, {} not measured{}.", goals.size(), count(Verdict::Met),
                  count(Verdict::Missed), count(Verdict::NotMeasured),
                  report.is_quick ? " (a quick run: small, short, goals for full size do not apply)" : ""));
  page.table(goal_table(report));
  for (const std::string& sentence : missing_peers()) page.paragraph(sentence);
  page.heading("Plots");
  page.figure(streaming_bound_plot(report), "Lower is better. The slope is what a finer bound costs.");
  page.figure(streaming_time_plot(report), "Lower left is better.");
  page.figure(
      streaming_motion_plot(report),
      "Peers: the one with the fewest bits that keeps the bound, per motion; beside each its wildest part.");
  page.heading("Every clip, strand model and wind");
  page.paragraph(kCaseText);
  page.table(case_table(report));
  page.heading("From motion to decoded frame");
  page.paragraph(kLatencyText);
  page.table(latency_table(report.latency));
  page.heading("How it was measured");
  page.paragraph(method_text(report));
  page.paragraph(kPeerText);
  page.paragraph(class_text());
  page.table(recording_table(report));
  page.heading("Everything");
  for (const StreamRecording& recording : report.recordings) page.table(codec_table(report, recording));
  return page.text();
}

std::string streaming_summary(const StreamingReport& report) {
  std::string text = needs_text(report) + "\n";
  for (const StreamViewRow& row : report.view.rows)
    text += fmt::format("{} at {:.2f} mm from {:g} m: {:.1f} dB, SSIM {:.3f}\n", row.codec,
                        kMmPerM * row.bound_m, row.distance_m, row.psnr_db, row.ssim);
  for (const PlayoutRow& row : report.playout)
    text += fmt::format("between states at 30 Hz, {}, {}: {:.1f} dB, SSIM {:.3f}\n", row.motion,
                        to_string(row.interpolation), row.psnr_db, row.ssim);
  if (!report.playout_note.empty()) text += report.playout_note + "\n";
  size_t unmeasured = 0;
  for (const GoalLine& line : judge_streaming(report)) {
    if (line.verdict == Verdict::NotMeasured)
      ++unmeasured;
    else
      text += fmt::format("{:<6} {}: {}\n", to_string(line.verdict), line.goal, line.measured);
  }
  if (unmeasured > 0)
    text +=
        fmt::format("{} goals are stated for sizes, strand models and clips that did not run.\n", unmeasured);
  for (const StreamingRow& row : report.rows)
    if (!row.keeps_bound())
      text += fmt::format("misses its bound: {} at {:.3g} mm on {}, {}: {:.4g} mm\n", row.codec,
                          kMmPerM * row.bound_m, row.motion, to_string(row.size), kMmPerM * row.max_error_m);
  for (const std::string& sentence : missing_peers()) text += sentence + "\n";
  return text;
}

Status save_streaming(const StreamingReport& report, const std::filesystem::path& folder) {
  RETURN_IF_ERROR(save_text(folder / kStreamingCsv, streaming_csv(report)));
  RETURN_IF_ERROR(save_text(folder / "streaming_bound.svg", streaming_bound_plot(report)));
  RETURN_IF_ERROR(save_text(folder / "streaming_time.svg", streaming_time_plot(report)));
  RETURN_IF_ERROR(save_text(folder / "streaming_motion.svg", streaming_motion_plot(report)));
  RETURN_IF_ERROR(save_text(folder / "streaming_view.csv", view_csv(report.view)));
  RETURN_IF_ERROR(save_text(folder / "streaming_playout.csv", playout_csv(report.playout)));
  RETURN_IF_ERROR(save_text(folder / "streaming_pixels.csv", pixel_csv(report.view)));
  RETURN_IF_ERROR(save_text(folder / "streaming_view.svg", view_plot(report.view)));
  return save_text(folder / kStreamingPage, streaming_page(report));
}

}  // namespace strandcast
