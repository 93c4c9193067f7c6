#include "client/app/recording_commands.h"

#include <algorithm>
#include <ctime>
#include <iostream>

#include "client/app/ctl_commands.h"
#include "client/export/timecode_track.h"
#include "common/base/units.h"
#include "common/record/recording_check.h"
#include "common/record/recording_reader.h"
#include "common/scene/scene_file.h"

namespace strandcast {
namespace {

constexpr double kBytesPerMb = 1e6;

std::string date_text(int64_t unix_time_ns) {
  const auto seconds = static_cast<std::time_t>(unix_time_ns / 1'000'000'000);
  std::tm parts{};
  char text[32] = "?";
  if (::gmtime_r(&seconds, &parts) != nullptr)
    std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
}

std::string state_text(const RecordingInfo& info) {
  if (!info.index_trouble.empty())
    return fmt::format("damaged index ({}); strandcast-ctl recover makes it whole", info.index_trouble);
  if (info.is_indexed) return "whole, with its index";
  return fmt::format("cut off{}, or still being written; strandcast-ctl recover makes it whole",
                     info.cut_bytes > 0 ? fmt::format(" with {} bytes of a chunk that is not", info.cut_bytes)
                                        : std::string());
}

std::string hair_text(const RecordingReader& reader) {
  const auto asset = reader.asset();
  if (!asset) return asset.error().to_string();
  return fmt::format("{} strands x {} vertices, by {}", asset->strand_count, asset->vertex_count,
                     reader.start().codec);
}

std::string keyframe_text(const std::vector<int64_t>& times_ns) {
  int64_t longest_ns = 0;
  for (size_t i = 1; i < times_ns.size(); ++i)
    longest_ns = std::max(longest_ns, times_ns[i] - times_ns[i - 1]);
  return fmt::format("{} keyframes, at most {:.1f} s apart", times_ns.size(),
                     static_cast<double>(longest_ns) / kNsPerS);
}

std::string check_text(const RecordingCheck& check) {
  std::string text = fmt::format("{} chunks, {} states, {} frames of which {} decode with their hash",
                                 check.chunks, check.states, check.frames, check.decoded_frames);
  if (check.equal_states > 0)
    text += fmt::format(", {} of them equal to what was published bit for bit", check.equal_states);
  if (check.lost_frames + check.lost_messages > 0)
    text += fmt::format("; {} frames and {} messages found no room when it was recorded", check.lost_frames,
                        check.lost_messages);
  return text;
}

void print_problems(const RecordingCheck& check) {
  for (const std::string& problem : check.problems) std::cout << "  " << problem << '\n';
  if (check.problem_count > check.problems.size())
    std::cout << fmt::format("  and {} more\n", check.problem_count - check.problems.size());
}

void print_line(const char* name, const std::string& text) {
  std::cout << fmt::format("  {:<10} {}\n", name, text);
}

/// What the bytes of the file are.
void print_contents(const RecordingContents& contents, const RecordingInfo& info) {
  std::vector<std::pair<std::string, RecordedTopic>> topics(contents.begin(), contents.end());
  std::sort(topics.begin(), topics.end(),
            [](const auto& a, const auto& b) { return a.second.bytes > b.second.bytes; });
  uint64_t rest = info.file_bytes;
  for (const auto& [topic, counted] : topics) {
    std::cout << fmt::format("  {:>9.3f} MB {:<18} {}\n", static_cast<double>(counted.bytes) / kBytesPerMb,
                             topic, counted.items);
    rest -= std::min(rest, counted.bytes);
  }
  std::cout << fmt::format("  {:>9.3f} MB {}\n", static_cast<double>(rest) / kBytesPerMb,
                           "schemas and indexes");
}

struct RecordedCounts {
  std::optional<uint64_t> first_tick;
  TimecodeTrack timecodes;
};

/// Of all states, as far as they can be read.
RecordedCounts read_counts(RecordingReader& reader) {
  RecordedCounts counts;
  for (auto item = reader.next(); item && *item; item = reader.next()) {
    const auto* state = std::get_if<RecordedState>(&std::get<RecordedMessage>((*item)->what));
    if (state == nullptr) continue;
    if (!counts.first_tick) counts.first_tick = state->tick;
    if (state->timecode) counts.timecodes.add(state->sim_time_ns, *state->timecode);
  }
  return counts;
}

}  // namespace

int run_recording_info(const std::filesystem::path& path) {
  const auto reader = RecordingReader::open(path, RecordedPart::Messages);
  if (!reader) return ctl_failure(reader.error());
  const RecordingStart& start = (*reader)->start();
  const RecordingInfo& info = (*reader)->info();
  const auto scene = parse_scene(start.scene_text, "the recording's scene", {});
  std::cout << fmt::format("{}: a recording of scene '{}'\n", path.string(),
                           scene ? scene->name : scene.error().to_string());
  const int64_t length_ns = std::max<int64_t>(0, info.last_sim_time_ns - info.first_sim_time_ns);
  print_line("recorded", fmt::format("{} by {} {}, {:.1f} s of simulation", date_text(start.unix_time_ns),
                                     "strandcast-server", start.server_version,
                                     static_cast<double>(length_ns) / kNsPerS));
  const RecordedCounts counts = read_counts(**reader);
  if (counts.first_tick.value_or(0) > 0)
    print_line("began", fmt::format("at step {}, while the simulation ran: --replay cannot simulate it again",
                                    *counts.first_tick));
  if (const std::string take = take_text(start.slate, start.take); !take.empty()) print_line("take", take);
  if (const std::string timecode = counts.timecodes.text(); !timecode.empty())
    print_line("timecode", timecode);
  print_line("simulated", start.sim_device_name);
  if (scene)
    print_line("scene", fmt::format("solver {}, {:g} steps/s of {} substeps, within {:g} mm",
                                    scene->solver.name, scene->step_rate_hz, scene->substeps,
                                    static_cast<double>(scene->stream.bound_m) * kMmPerM));
  print_line("hair", hair_text(**reader));
  print_line("strands", keyframe_text(info.keyframe_sim_time_ns));
  print_contents((*reader)->contents(), info);
  print_line("file",
             fmt::format("{:.1f} MB, {} chunks: {}", static_cast<double>(info.file_bytes) / kBytesPerMb,
                         info.chunk_count, state_text(info)));
  return info.index_trouble.empty() ? kDoneExit : kRefusedExit;
}

int run_recording_check(const std::filesystem::path& path) {
  const auto check = check_recording(path);
  if (!check) return ctl_failure(check.error());
  std::cout << fmt::format("{}: {}\n", path.string(), check_text(*check));
  print_problems(*check);
  if (check->is_sound())
    std::cout << "sound\n";
  else if (check->is_sound_so_far())
    std::cout << "sound so far: cut off, or still being written; strandcast-ctl recover makes it whole\n";
  else
    std::cout << "not sound; strandcast-ctl recover keeps what is\n";
  return check->is_sound() ? kDoneExit : kRefusedExit;
}

int run_recover(const std::filesystem::path& from, std::filesystem::path to) {
  if (to.empty()) to = std::filesystem::path(from).replace_extension(".recovered.mcap");
  const auto recovery = recover_recording(from, to);
  if (!recovery) return ctl_failure(recovery.error());
  std::cout << fmt::format("{}: {} chunks kept, {} damaged ones left out, {} bytes cut off\n", to.string(),
                           recovery->kept_chunks, recovery->left_out_chunks, recovery->cut_bytes);
  if (recovery->left_out_frames > 0)
    std::cout << fmt::format("{} frames left out that cannot be decoded without them\n",
                             recovery->left_out_frames);
  std::cout << check_text(recovery->check) << '\n';
  print_problems(recovery->check);
  return recovery->check.is_sound() ? kDoneExit : kRefusedExit;
}

int run_compare(const std::filesystem::path& a, const std::filesystem::path& b) {
  const auto compared = compare_recordings(a, b);
  if (!compared) return ctl_failure(compared.error());
  for (const std::string& note : compared->notes) std::cout << note << '\n';
  std::cout << fmt::format("{} states have equal hashes\n", compared->equal_states);
  if (compared->compared_frames > 0)
    std::cout << fmt::format("strands of {} steps in both: at most {:g} mm apart (step {})\n",
                             compared->compared_frames, compared->max_distance_m * kMmPerM,
                             compared->max_distance_tick);
  if (!compared->first_different_tick) return kDoneExit;
  std::cout << fmt::format("step {} is the first that differs: {}\n", *compared->first_different_tick,
                           compared->difference);
  return kRefusedExit;
}

}  // namespace strandcast
