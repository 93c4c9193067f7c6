#include "server/app/server_metrics.h"

#include <algorithm>
#include <map>
#include <string_view>

#include "common/log/log.h"
#include "server/net/metrics.h"

namespace strandcast {
namespace {

/// A counter when its name says so, else a gauge.
struct Row {
  std::string_view name;
  const char* help;
  double (*value)(const ServerCounters&);
};

constexpr Row kRows[] = {
    {"sim_steps_total", "Simulation steps.",
     [](const ServerCounters& all) { return static_cast<double>(all.sim.tick); }},
    {"sim_step_median_ms", "Time of the solver for one step, median of the last ones.",
     [](const ServerCounters& all) { return all.sim.step_median_ms; }},
    {"sim_realtime_factor", "Simulated time per real time.",
     [](const ServerCounters& all) { return all.sim.realtime_factor; }},
    {"sim_detail_level",
     "What the simulation leaves out: 0 nothing, 1 hair on hair, 2 most strands, 3 half of the vertices, 4 "
     "every other "
     "step, 5 all.",
     [](const ServerCounters& all) { return static_cast<double>(all.sim.detail); }},
    {"sim_detail_changes_total", "Changes of that level.",
     [](const ServerCounters& all) { return static_cast<double>(all.sim.detail_changes); }},
    {"sim_simulated_strands", "Strands that take steps; the others follow them, or the head.",
     [](const ServerCounters& all) { return static_cast<double>(all.sim.simulated_strands); }},
    {"sim_slow_motion", "1 while simulated time falls behind real time.",
     [](const ServerCounters& all) { return all.is_slow ? 1.0 : 0.0; }},
    {"sim_slow_motions_total", "Times that slow motion began.",
     [](const ServerCounters& all) { return static_cast<double>(all.slow_motions); }},
    {"sim_timecode_frames", "Timecode of the newest step, in frames since midnight; -1 where nobody counts.",
     [](const ServerCounters& all) {
       return all.sim.timecode ? static_cast<double>(all.sim.timecode->frame) : -1.0;
     }},
    {"sim_dropped_steps_total", "Steps left out because the simulation was late.",
     [](const ServerCounters& all) { return static_cast<double>(all.sim.dropped_steps); }},
    {"publish_read_median_ms", "Time to read a state back from the GPU, median.",
     [](const ServerCounters& all) { return all.sim.read_median_ms; }},
    {"publish_quantise_median_ms", "Time to bring a state onto the codec's lattice, median.",
     [](const ServerCounters& all) { return all.sim.quantise_median_ms; }},
    {"publish_snapshots_total", "States published.",
     [](const ServerCounters& all) { return static_cast<double>(all.sim.published); }},
    {"publish_quarantined_total", "Strands put back to rest because they had no usable numbers.",
     [](const ServerCounters& all) { return static_cast<double>(all.sim.quarantined); }},
    {"publish_overstretched_total", "Strands put back to rest because they had stretched too far.",
     [](const ServerCounters& all) { return static_cast<double>(all.sim.overstretched); }},
    {"encode_frames_total", "Strand frames encoded for the first class.",
     [](const ServerCounters& all) { return static_cast<double>(all.encode.encodes); }},
    {"encode_all_classes_frames_total", "Strand frames encoded for all classes.",
     [](const ServerCounters& all) {
       uint64_t sum = 0;
       for (const auto& [stream_id, one] : all.strand_streams) sum += one.encodes;
       return static_cast<double>(sum);
     }},
    {"strand_classes_in_use", "Strand classes that somebody watches, by each codec.",
     [](const ServerCounters& all) { return static_cast<double>(all.strand_classes_in_use); }},
    {"encode_keyframes_total", "Keyframes of the first class.",
     [](const ServerCounters& all) { return static_cast<double>(all.encode.keyframes); }},
    {"encode_delta_bytes_total", "Bytes of the deltas of the first class.",
     [](const ServerCounters& all) { return static_cast<double>(all.encode.delta_bytes); }},
    {"encode_exact_frames_total", "Strand frames of the first class that carry no corrections.",
     [](const ServerCounters& all) { return static_cast<double>(all.encode.exact); }},
    {"encode_median_ms", "Time to encode a frame of the first class, median.",
     [](const ServerCounters& all) { return all.encode.encode_median_ms; }},
    {"render_frames_total", "Pictures encoded.",
     [](const ServerCounters& all) { return static_cast<double>(all.frames.frames); }},
    {"render_paints_total", "Pictures drawn.",
     [](const ServerCounters& all) { return static_cast<double>(all.frames.paints); }},
    {"render_left_out_strands", "Strands that the newest picture lacks because they do not fit into memory.",
     [](const ServerCounters& all) { return static_cast<double>(all.frames.left_out_strands); }},
    {"render_unusable_segments", "Segments that the newest picture lacks because a position is no number.",
     [](const ServerCounters& all) { return static_cast<double>(all.frames.unusable_segments); }},
    {"render_unchanged_total", "Pictures not sent because nothing had changed.",
     [](const ServerCounters& all) { return static_cast<double>(all.frames.unchanged); }},
    {"render_stills_total", "Pictures sent once more, finely, because nothing changed any more.",
     [](const ServerCounters& all) { return static_cast<double>(all.frames.stills); }},
    {"render_wholes_total", "Pictures encoded to stand alone.",
     [](const ServerCounters& all) { return static_cast<double>(all.frames.wholes); }},
    {"render_bytes_total", "Bytes of all pictures.",
     [](const ServerCounters& all) { return static_cast<double>(all.frames.bytes); }},
    {"render_median_ms", "Time to draw a picture, median.",
     [](const ServerCounters& all) { return all.frames.paint_median_ms; }},
    {"render_encode_median_ms", "Time to encode a picture, median.",
     [](const ServerCounters& all) { return all.frames.encode_median_ms; }},
    {"input_accepted_total", "Samples of motion and wind taken.",
     [](const ServerCounters& all) { return static_cast<double>(all.input.accepted); }},
    {"input_rejected_total", "Samples of motion and wind refused.",
     [](const ServerCounters& all) { return static_cast<double>(all.input.rejected()); }},
    {"viewers_strands", "Viewers that get strands.",
     [](const ServerCounters& all) { return static_cast<double>(all.strand_viewers); }},
    {"viewers_frames", "Viewers that get pictures.",
     [](const ServerCounters& all) { return static_cast<double>(all.frame_viewers); }},
    {"log_dropped_lines_total", "Lines of the log that nobody read in time.",
     [](const ServerCounters&) { return static_cast<double>(dropped_log_lines()); }}};

std::string format_codecs(const std::map<std::string, uint32_t>& viewers_of) {
  constexpr const char* kName = "strandcast_viewers_strands_of_codec";
  std::string text = fmt::format("# HELP {0} Viewers that get strands, by codec.\n# TYPE {0} gauge\n", kName);
  for (const auto& [codec, viewers] : viewers_of)
    text += fmt::format("{}{{codec=\"{}\"}} {}\n", kName, codec, viewers);
  return viewers_of.empty() ? std::string() : text;
}

/// Of live inputs; a counter when its name says so.
struct LiveRow {
  std::string_view name;
  const char* help;
  double (*value)(const LiveInputStatus&);
};

constexpr LiveRow kLiveRows[] = {
    {"live_stale", "1 while nothing of the subject that drives the head has come for a second.",
     [](const LiveInputStatus& input) { return input.is_stale ? 1.0 : 0.0; }},
    {"live_rate_hz", "Packets a second.", [](const LiveInputStatus& input) { return input.rate_hz; }},
    {"live_jitter_ms", "How unevenly packets come.",
     [](const LiveInputStatus& input) { return input.jitter_ms; }},
    {"live_age_ms", "Since the newest packet; 0 before the first.",
     [](const LiveInputStatus& input) { return input.age_ms; }},
    {"live_packets_total", "Packets that could be read.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.packets); }},
    {"live_received_bytes_total", "Bytes of them.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.received_bytes); }},
    {"live_malformed_total", "Packets that could not be read.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.malformed); }},
    {"live_refused_total", "Packets of senders that may not send, or while another one is heard.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.refused); }},
    {"live_over_rate_total", "Packets left out because more came than one source may send.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.over_rate); }},
    {"live_impossible_total", "Poses that were no numbers, no rotation or out of the world.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.impossible); }},
    {"live_clamped_total", "Poses that were faster than a head moves.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.clamped); }},
    {"live_gated_total", "Poses not believed, because the body was somewhere else at once.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.gated); }},
    {"live_resequenced_total", "Poses put back into their order.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.resequenced); }},
    {"live_late_total", "Poses that came twice, or too late to be used.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.late); }},
    {"live_lost_total", "Numbers of frames that never came.",
     [](const LiveInputStatus& input) { return static_cast<double>(input.lost); }}};

/// Nothing where there are no live inputs.
std::string format_live(const std::vector<LiveInputStatus>& inputs) {
  std::string text;
  if (inputs.empty()) return text;
  for (const LiveRow& row : kLiveRows) {
    text += fmt::format("# HELP strandcast_{0} {1}\n# TYPE strandcast_{0} {2}\n", row.name, row.help,
                        row.name.ends_with("_total") ? "counter" : "gauge");
    for (size_t i = 0; i < inputs.size(); ++i)
      text += fmt::format("strandcast_{}{{input=\"{}\",protocol=\"{}\"}} {}\n", row.name, i,
                          inputs[i].input.substr(0, inputs[i].input.find(' ')), row.value(inputs[i]));
  }
  return text;
}

std::string format_recording(const RecordCounters& record) {
  const auto row = [](std::string_view name, const char* help, double value) {
    return format_metric(name, name.ends_with("_total") ? "counter" : "gauge", help, value);
  };
  return row("record_active", "1 while a recording is written.", record.has_failed ? 0.0 : 1.0) +
         row("record_bytes_total", "Bytes of the recording.", static_cast<double>(record.written_bytes)) +
         row("record_strand_bytes_total", "Bytes of strands in it, as they were encoded.",
             static_cast<double>(record.frame_bytes)) +
         row("record_frames_total", "Strand frames in it.", static_cast<double>(record.frames)) +
         row("record_states_total", "States whose hash is in it.", static_cast<double>(record.states)) +
         row("record_lost_frames_total", "Strand frames that the disk was too slow for.",
             static_cast<double>(record.lost_frames)) +
         row("record_lost_messages_total", "Inputs, steps and states that it was too slow for.",
             static_cast<double>(record.lost_messages)) +
         row("record_waiting_bytes", "Bytes that wait for the disk.",
             static_cast<double>(record.waiting_bytes)) +
         row("record_lag_ms", "Age of the newest that the recorder has taken.", record.lag_ms);
}

/// Returns whether a family is of the process, not of a head; the first text that has it then counts.
bool is_of_process(std::string_view family) {
  return family == "strandcast_build_info" || family == "strandcast_log_dropped_lines_total" ||
         family.starts_with("strandcast_gl_");
}

/// A line of a metric with one more label in front of its own.
std::string with_label(std::string_view line, const std::string& label) {
  const size_t end = line.find_first_of("{ ");
  const bool has_labels = end != std::string_view::npos && line[end] == '{';
  return fmt::format("{}{{{}{}{}", line.substr(0, end), label, has_labels ? "," : "}",
                     line.substr(has_labels ? end + 1 : end));
}

/// Families of several texts, each once: its comments, and the lines of all.
class FamilyJoiner {
 public:
  void add(std::string_view text, const std::string& head) {
    const std::string label = fmt::format("head=\"{}\"", label_value(head));
    Family* family = nullptr;
    bool is_new = false;
    while (!text.empty()) {
      const std::string_view line = text.substr(0, text.find('\n'));
      text.remove_prefix(std::min(line.size() + 1, text.size()));
      if (line.starts_with(kHelp)) {
        const std::string name(line.substr(kHelp.size(), line.find(' ', kHelp.size()) - kHelp.size()));
        is_new = !place_of_.contains(name);
        if (is_new) families_.push_back({is_of_process(name), {}});
        family = &families_[place_of_.try_emplace(name, families_.size() - 1).first->second];
      }
      const bool is_comment = line.starts_with('#');
      if (is_new && (is_comment || family->is_of_process)) family->text += fmt::format("{}\n", line);
      if (!is_comment && !family->is_of_process) family->text += with_label(line, label) + '\n';
    }
  }
  std::string text() const {
    std::string all;
    for (const Family& family : families_) all += family.text;
    return all;
  }

 private:
  static constexpr std::string_view kHelp = "# HELP ";
  struct Family {
    bool is_of_process = false;
    std::string text;
  };
  std::vector<Family> families_;
  std::map<std::string, size_t> place_of_;  // by name
};

}  // namespace

std::string join_metrics(const std::vector<HeadMetrics>& heads, const std::string& process) {
  if (heads.size() == 1) return heads.front().before + process + heads.front().after;
  FamilyJoiner joined;
  for (const HeadMetrics& one : heads) joined.add(one.before + one.after, one.head);
  return joined.text() + process;
}

std::string format_server_metrics(const ServerCounters& counters, const char* version) {
  std::string text = format_build_info(version);
  if (!counters.sim.sim_device.empty())
    text += format_info("sim_device_info", "Always 1; the labels say what simulates.",
                        {{"device", counters.sim.sim_device}, {"name", counters.sim.sim_device_name}});
  if (!counters.sim.sim_device.empty())
    text += format_info("sim_detail_info",
                        "Always 1; the labels say how much is simulated, and why not all of it.",
                        {{"level", to_string(counters.sim.detail)}, {"reason", counters.sim.detail_reason}});
  for (const Row& row : kRows)
    text += format_metric(row.name, row.name.ends_with("_total") ? "counter" : "gauge", row.help,
                          row.value(counters));
  text += format_codecs(counters.strand_viewers_of);
  text += format_live(counters.live_inputs);
  if (counters.record) text += format_recording(*counters.record);
  return text + format_histogram("sim_step_ms", "Time of the solver for one step.", counters.sim.step_times);
}

}  // namespace strandcast
