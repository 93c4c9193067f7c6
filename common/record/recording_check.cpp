#include "common/record/recording_check.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "common/base/crc32.h"
#include "common/record/chunk_list.h"
#include "common/record/recording_reader.h"
#include "common/record/strand_frames.h"

namespace strandcast {
namespace {

constexpr size_t kReadBytes = 1u << 20;
/// States whose hash is kept until their frame comes: about a second apart at the most rates.
constexpr size_t kMaxOpenStates = 4096;

void add_problem(RecordingCheck& check, std::string_view sentence) {
  ++check.problem_count;
  if (check.problems.size() < kMaxProblems) check.problems.emplace_back(sentence);
}

/// Of codecs that change nothing of what is published.
bool is_exact(const std::string& codec) {
  return codec == "raw" || codec == "delta";
}

Result<uint32_t> crc_of(ByteSource& source, uint64_t end) {
  std::vector<std::byte> bytes;
  uint32_t crc = 0;
  for (uint64_t offset = 0; offset < end; offset += bytes.size()) {
    bytes.resize(static_cast<size_t>(std::min<uint64_t>(kReadBytes, end - offset)));
    RETURN_IF_ERROR(source.read(offset, bytes));
    crc = crc32(bytes, crc);
  }
  return crc;
}

/// Checks the file's records, and its index against them.
Status check_file(ByteSource& source, RecordingCheck& check) {
  ASSIGN_OR_RETURN(const ChunkList walked, walk_chunks(source));
  ASSIGN_OR_RETURN(const ChunkList listed, list_chunks(source));
  check.chunks = walked.chunks.size();
  check.is_whole = listed.is_indexed;
  check.is_cut_off = !walked.has_end;
  if (walked.cut_bytes > 0)
    add_problem(check,
                fmt::format("it is cut off: {} bytes at its end are no whole record", walked.cut_bytes));
  else if (!walked.has_end)
    add_problem(check, "it was not closed and has no index");
  if (!listed.index_trouble.empty()) add_problem(check, listed.index_trouble);
  if (walked.has_end && !listed.is_indexed && listed.index_trouble.empty())
    add_problem(check, "its end is damaged, and with it the index");
  const auto is_same = [](const ChunkPlace& a, const ChunkPlace& b) {
    return a.offset == b.offset && a.size_bytes == b.size_bytes && a.start_time == b.start_time &&
           a.channel == b.channel;
  };
  if (listed.is_indexed && !std::equal(walked.chunks.begin(), walked.chunks.end(), listed.chunks.begin(),
                                       listed.chunks.end(), is_same))
    add_problem(check, fmt::format("the index has {} chunks, and {} are there or elsewhere",
                                   listed.chunks.size(), walked.chunks.size()));
  if (listed.is_indexed && walked.message_counts != listed.message_counts)
    add_problem(check, "the statistics count other messages than are there");
  if (!walked.has_end || walked.data_crc == 0) return {};
  ASSIGN_OR_RETURN(const uint32_t crc, crc_of(source, walked.data_end));
  if (crc != walked.data_crc)
    add_problem(check,
                fmt::format("the CRC of the data is {:08x}, and {:08x} was written", crc, walked.data_crc));
  return {};
}

/// What the items say, in their order.
class ItemCheck {
 public:
  ItemCheck(const std::string& codec, std::unique_ptr<StrandDecoder> decoder, RecordingCheck& check)
      : is_exact_(is_exact(codec)), decoder_(std::move(decoder)), check_(check) {}

  void look_at(const RecordedItem& item) {
    if (const auto* frame = std::get_if<RecordedFrame>(&item.what)) return look_at_frame(*frame);
    const auto& message = std::get<RecordedMessage>(item.what);
    if (const auto* state = std::get_if<RecordedState>(&message)) return look_at_state(*state);
    if (const auto* step = std::get_if<RecordedStep>(&message)) {
      if (step->tick <= step_tick_)
        add_problem(check_, fmt::format("step {} stands behind step {}", step->tick, step_tick_));
      step_tick_ = step->tick;
    }
    if (const auto* loss = std::get_if<RecordedLoss>(&message)) {
      check_.lost_frames += loss->frames;
      check_.lost_messages += loss->messages;
    }
  }

 private:
  void look_at_state(const RecordedState& state) {
    ++check_.states;
    if (state.tick < state_tick_)
      add_problem(check_,
                  fmt::format("the state of step {} stands behind that of {}", state.tick, state_tick_));
    state_tick_ = state.tick;
    if (!is_exact_) return;
    hashes_[state.tick].push_back(state.state_hash);
    if (hashes_.size() > kMaxOpenStates) hashes_.erase(hashes_.begin());
  }
  void look_at_frame(const RecordedFrame& frame) {
    ++check_.frames;
    const auto snapshot = decoder_->decode(frame.frame->message);
    // Behind a loss nothing can be decoded before the next keyframe; the loss was told.
    const bool is_after_loss = !snapshot && snapshot.error().code == ErrorCode::Unavailable;
    if (is_after_loss && check_.lost_frames > 0) return;
    if (!snapshot)
      return add_problem(
          check_, fmt::format("frame {}: {}", frame.frame->header.sequence, snapshot.error().to_string()));
    ++check_.decoded_frames;
    const auto recorded = hashes_.find((*snapshot)->tick);
    if (recorded == hashes_.end()) return;
    const auto& hashes = recorded->second;
    if (std::find(hashes.begin(), hashes.end(), state_hash(**snapshot)) != hashes.end())
      ++check_.equal_states;
    else
      add_problem(check_, fmt::format("the strands of step {} are not the state that was published",
                                      (*snapshot)->tick));
  }

  const bool is_exact_;
  const std::unique_ptr<StrandDecoder> decoder_;
  RecordingCheck& check_;
  uint64_t step_tick_ = 0;
  uint64_t state_tick_ = 0;
  std::map<uint64_t, std::vector<uint64_t>> hashes_;  // by tick
};

Status check_items(RecordingReader& reader, RecordingCheck& check) {
  std::unique_ptr<StrandDecoder> decoder;
  if (reader.asset_frame() != nullptr) {
    ASSIGN_OR_RETURN(decoder, make_recorded_decoder(reader));
  }
  ItemCheck items(reader.start().codec, std::move(decoder), check);
  while (true) {
    const auto item = reader.next();
    if (!item)
      add_problem(check, item.error().to_string());
    else if (*item)
      items.look_at(**item);
    else
      return {};
  }
}

/// The same source once more, for a reader of its own.
class BorrowedSource : public ByteSource {
 public:
  explicit BorrowedSource(ByteSource& source) : source_(source) {}
  uint64_t size_bytes() const override { return source_.size_bytes(); }
  Status read(uint64_t offset, std::span<std::byte> destination) override {
    return source_.read(offset, destination);
  }

 private:
  ByteSource& source_;
};

// ---- two recordings ----

/// The next state's hash; nothing at the end.
Result<std::optional<RecordedState>> next_state(RecordingReader& reader) {
  while (true) {
    ASSIGN_OR_RETURN(const auto item, reader.next());
    if (!item) return std::optional<RecordedState>();
    if (const auto* state = std::get_if<RecordedState>(&std::get<RecordedMessage>(item->what)))
      return std::optional(*state);
  }
}

struct StatePair {
  std::optional<RecordedState> a;
  std::optional<RecordedState> b;
};

void add_note(RecordingComparison& result, std::string_view sentence) {
  result.notes.emplace_back(sentence);
}

/// What is found is no error.
Status differ(RecordingComparison& result, uint64_t tick, std::string what) {
  result.first_different_tick = tick;
  result.difference = std::move(what);
  return {};
}

Result<StatePair> next_states(RecordingReader& a, RecordingReader& b) {
  StatePair next;
  ASSIGN_OR_RETURN(next.a, next_state(a));
  ASSIGN_OR_RETURN(next.b, next_state(b));
  return next;
}

/// The first states that both have, where one began later than the other.
Result<StatePair> first_states(RecordingReader& a, RecordingReader& b, RecordingComparison& result) {
  ASSIGN_OR_RETURN(StatePair first, next_states(a, b));
  if (!first.a || !first.b || first.a->tick == first.b->tick) return first;
  const bool is_a_later = first.a->tick > first.b->tick;
  const uint64_t begin = std::max(first.a->tick, first.b->tick);
  add_note(result, fmt::format("the {} one begins at step {}", is_a_later ? "first" : "second", begin));
  std::optional<RecordedState>& earlier = is_a_later ? first.b : first.a;
  while (earlier && earlier->tick < begin) {
    ASSIGN_OR_RETURN(earlier, next_state(is_a_later ? b : a));
  }
  return first;
}

Status compare_states(RecordingReader& a, RecordingReader& b, RecordingComparison& result) {
  ASSIGN_OR_RETURN(StatePair now, first_states(a, b, result));
  if (!now.a || !now.b) {
    add_note(result, "they have no step in common");
    return {};
  }
  uint64_t tick = 0;
  while (now.a && now.b) {
    tick = std::min(now.a->tick, now.b->tick);
    if (now.a->tick != now.b->tick)
      return differ(
          result, tick,
          fmt::format("the first one has step {} there, the second one {}", now.a->tick, now.b->tick));
    if (now.a->state_hash != now.b->state_hash)
      return differ(result, tick,
                    fmt::format("the hashes are {:016x} and {:016x}", now.a->state_hash, now.b->state_hash));
    ++result.equal_states;
    ASSIGN_OR_RETURN(now, next_states(a, b));
  }
  // One that is longer is no other run: what both have is equal.
  if (now.a || now.b)
    add_note(result, fmt::format("the {} one goes on behind step {}", now.a ? "first" : "second", tick));
  return {};
}

void note_distance(const Snapshot& a, const Snapshot& b, RecordingComparison& result) {
  const std::vector<glm::vec3> in_a = positions_in_head(a);
  const std::vector<glm::vec3> in_b = positions_in_head(b);
  ++result.compared_frames;
  for (size_t i = 0; i < std::min(in_a.size(), in_b.size()); ++i) {
    const double distance_m = glm::distance(glm::dvec3(in_a[i]), glm::dvec3(in_b[i]));
    if (distance_m <= result.max_distance_m) continue;
    result.max_distance_m = distance_m;
    result.max_distance_tick = a.tick;
  }
}

/// Compares frames of the same step, as far as both recordings can be decoded.
void compare_strands(RecordingReader& a, RecordingReader& b, RecordingComparison& result) {
  auto in_a = StrandFrames::begin(a);
  auto in_b = StrandFrames::begin(b);
  if (!in_a || !in_b) return;
  auto state_a = in_a->next();
  auto state_b = in_b->next();
  while (state_a && state_b && *state_a && *state_b) {
    const Snapshot& one = **state_a;
    const Snapshot& other = **state_b;
    if (one.strand_count != other.strand_count || one.vertex_count != other.vertex_count) {
      add_note(result, "they have hair of different size: no distances");
      return;
    }
    if (one.tick == other.tick) note_distance(one, other, result);
    const bool goes_a = one.tick <= other.tick;
    const bool goes_b = other.tick <= one.tick;
    if (goes_a) state_a = in_a->next();
    if (goes_b) state_b = in_b->next();
  }
}

void note_starts(const RecordingStart& a, const RecordingStart& b, RecordingComparison& result) {
  if (a.scene_text != b.scene_text) add_note(result, "their scenes differ");
  if (a.sim_device != b.sim_device)
    add_note(result,
             fmt::format("one was simulated on {}, the other on {}", a.sim_device_name, b.sim_device_name));
  if (a.server_version != b.server_version)
    add_note(result,
             fmt::format("one was recorded by {}, the other by {}", a.server_version, b.server_version));
}

}  // namespace

Result<RecordingCheck> check_recording(ByteSource& source) {
  RecordingCheck check;
  RETURN_IF_ERROR(check_file(source, check));
  auto reader = RecordingReader::open(std::make_unique<BorrowedSource>(source));
  if (!reader) {
    const Error no_strands = reader.error();
    reader = RecordingReader::open(std::make_unique<BorrowedSource>(source), RecordedPart::Messages);
    if (!reader) return no_strands;
    add_problem(check, fmt::format("inputs and steps can be read, strands cannot: {}", no_strands.message));
  }
  RETURN_IF_ERROR(check_items(**reader, check));
  return check;
}

Result<RecordingCheck> check_recording(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const auto source, open_byte_source(path));
  auto check = check_recording(*source);
  if (!check) return at(path.string(), check.error());
  return check;
}

Result<RecordingComparison> compare_recordings(const std::filesystem::path& a,
                                               const std::filesystem::path& b) {
  RecordingComparison result;
  {
    ASSIGN_OR_RETURN(const auto in_a, RecordingReader::open(a, RecordedPart::Messages));
    ASSIGN_OR_RETURN(const auto in_b, RecordingReader::open(b, RecordedPart::Messages));
    note_starts(in_a->start(), in_b->start(), result);
    RETURN_IF_ERROR(compare_states(*in_a, *in_b, result));
  }
  ASSIGN_OR_RETURN(const auto in_a, RecordingReader::open(a, RecordedPart::Frames));
  ASSIGN_OR_RETURN(const auto in_b, RecordingReader::open(b, RecordedPart::Frames));
  compare_strands(*in_a, *in_b, result);
  return result;
}

}  // namespace strandcast
