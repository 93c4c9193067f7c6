#include "client/app/recorded_states.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/units.h"
#include "common/scene/scene_file.h"

namespace strandcast {
namespace {

/// What holds at this time: the last that began no later, or the first.
template <class Items>
const auto& at_time(const Items& items, int64_t time_ns) {
  const auto later = std::find_if(items.begin() + 1, items.end(),
                                  [time_ns](const auto& item) { return item.time_ns > time_ns; });
  return std::prev(later)->what;
}

}  // namespace

Result<std::unique_ptr<RecordedStates>> RecordedStates::open(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(auto reader, RecordingReader::open(path, RecordedPart::Frames));
  ASSIGN_OR_RETURN(SceneAsset asset, reader->asset());
  const auto scene = parse_scene(reader->start().scene_text, path.string() + ", its scene", {});
  if (!scene) return scene.error();
  std::unique_ptr<RecordedStates> states(new RecordedStates(std::move(reader)));
  states->scene_ = {std::make_shared<const SceneAsset>(std::move(asset)), scene->look.strand_radius_m,
                    scene->look.tip_scale};
  states->simulated_ = *scene;
  const RecordingStart& start = states->reader_->start();
  states->looks_.push_back({start.server_time_ns, {scene->look, scene->camera}});
  states->codecs_.push_back({start.server_time_ns, start.codec});
  RETURN_IF_ERROR(states->read_changes(path));
  if (const Status can = states->follow(start.server_time_ns); !can) return at(path.string(), can.error());
  return states;
}

/// Looks, codecs and what was lost, of all of the recording: whoever jumps in it has to know them.
Status RecordedStates::read_changes(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const auto messages, RecordingReader::open(path, RecordedPart::Messages));
  uint32_t damaged_in_a_row = 0;
  while (damaged_in_a_row < kMostDamagedInARow) {
    const auto item = messages->next();
    if (!item) {
      ++damaged_;
      ++damaged_in_a_row;
      continue;
    }
    damaged_in_a_row = 0;
    if (!*item) break;
    const auto* message = std::get_if<RecordedMessage>(&(*item)->what);
    if (message == nullptr) continue;
    if (const auto* look = std::get_if<LookChange>(message)) looks_.push_back({(*item)->time_ns, *look});
    if (const auto* stream = std::get_if<RecordedStream>(message))
      codecs_.push_back({(*item)->time_ns, stream->codec});
    if (const auto* state = std::get_if<RecordedState>(message); state != nullptr && state->timecode)
      timecodes_.add(state->sim_time_ns, *state->timecode);
    if (const auto* loss = std::get_if<RecordedLoss>(message)) lost_ += loss->frames;
  }
  return {};
}

/// Takes the look of this time, and the decoder of its codec.
Status RecordedStates::follow(int64_t time_ns) {
  look_ = at_time(looks_, time_ns);
  const std::string& codec = at_time(codecs_, time_ns);
  if (replay_ != nullptr && codec == codec_) return {};
  const SceneAsset& asset = *scene_.asset;
  ASSIGN_OR_RETURN(replay_, StrandReplay::make(codec, {asset.strand_count, asset.vertex_count}, {}));
  replay_->set_rest_shape(asset.rest_position_m);
  codec_ = codec;
  return {};
}

Status RecordedStates::seek(int64_t sim_time_ns) {
  replay_->forget_sequence();
  return reader_->seek(sim_time_ns);
}

Result<std::optional<int64_t>> RecordedStates::skip_to(double from_s) {
  // A cubic takes the state before, which the keyframe or one after it is.
  if (from_s > 0.0) RETURN_IF_ERROR(seek(first_ns() + std::llround(from_s * kNsPerS)));
  return std::optional(first_ns());
}

Result<std::shared_ptr<const Snapshot>> RecordedStates::next() {
  uint32_t damaged_in_a_row = 0;
  while (true) {
    const auto item = reader_->next();
    if (!item) {
      ++damaged_;
      if (++damaged_in_a_row == kMostDamagedInARow) return item.error();
      continue;
    }
    damaged_in_a_row = 0;
    if (!*item) return std::shared_ptr<const Snapshot>();
    const auto* frame = std::get_if<RecordedFrame>(&(*item)->what);
    if (frame == nullptr) continue;
    RETURN_IF_ERROR(follow((*item)->time_ns));
    // Nothing was sent here: there is no clock to compare with.
    if (auto state = replay_->receive(frame->frame->message, (*item)->time_ns, ClockOffset())) return state;
    ++rejected_;
  }
}

std::vector<std::string> RecordedStates::remarks() const {
  std::vector<std::string> remarks;
  const auto add = [&](uint64_t count, const char* what) {
    if (count > 0) remarks.push_back(fmt::format("{} {}", count, what));
  };
  add(lost_, "states were not recorded, for want of room; the frames between are interpolated");
  add(damaged_, "parts of the recording are damaged and left out");
  add(rejected_, "recorded frames could not be decoded");
  add(reader_->info().cut_bytes, "bytes at its end are of a part that was not written whole");
  return remarks;
}

}  // namespace strandcast
