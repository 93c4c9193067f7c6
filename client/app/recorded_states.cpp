#include "client/app/recorded_states.h"

#include <cmath>
#include <utility>

#include "common/scene/scene_file.h"

namespace strandcast {
namespace {

constexpr double kNsPerS = 1e9;

}  // namespace

Result<std::unique_ptr<RecordedStates>> RecordedStates::open(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(auto reader, RecordingReader::open(path));
  ASSIGN_OR_RETURN(SceneAsset asset, reader->asset());
  const auto scene = parse_scene(reader->start().scene_text, path.string() + ", its scene", {});
  if (!scene) return scene.error();
  auto replay = StrandReplay::make(reader->start().codec, {asset.strand_count, asset.vertex_count}, {});
  if (!replay) return at(path.string(), replay.error());
  (*replay)->set_rest_shape(asset.rest_position_m);
  std::unique_ptr<RecordedStates> states(new RecordedStates(std::move(reader), std::move(replay).value()));
  states->scene_ = {std::make_shared<const SceneAsset>(std::move(asset)), scene->look.strand_radius_m,
                    scene->look.tip_scale};
  states->look_ = {scene->look, scene->camera};
  return states;
}

RecordedStates::RecordedStates(std::unique_ptr<RecordingReader> reader, std::unique_ptr<StrandReplay> replay)
    : reader_(std::move(reader)), replay_(std::move(replay)) {}

Status RecordedStates::seek(int64_t sim_time_ns) {
  replay_->forget_sequence();
  return reader_->seek(sim_time_ns);
}

Result<std::optional<int64_t>> RecordedStates::skip_to(double from_s) {
  // A cubic takes the state before, which the keyframe or one after it is.
  if (from_s > 0.0) RETURN_IF_ERROR(seek(first_ns() + std::llround(from_s * kNsPerS)));
  return std::optional(first_ns());
}

void RecordedStates::take(const RecordedMessage& message) {
  if (const auto* look = std::get_if<LookChange>(&message)) look_ = *look;
  if (const auto* loss = std::get_if<RecordedLoss>(&message)) lost_ += loss->frames;
  if (const auto* stream = std::get_if<RecordedStream>(&message))
    if (!replay_->follow_codec(stream->codec, scene_.asset->rest_position_m)) ++damaged_;
}

Result<std::shared_ptr<const Snapshot>> RecordedStates::next() {
  while (true) {
    const auto item = reader_->next();
    if (!item) {
      ++damaged_;
      continue;
    }
    if (!*item) return std::shared_ptr<const Snapshot>();
    if (const auto* message = std::get_if<RecordedMessage>(&(*item)->what)) {
      take(*message);
      continue;
    }
    const RecordedFrame& frame = std::get<RecordedFrame>((*item)->what);
    // Nothing was sent here: there is no clock to compare with.
    if (auto state = replay_->receive(frame.frame->message, (*item)->time_ns, ClockOffset())) return state;
  }
}

std::vector<std::string> RecordedStates::remarks() const {
  std::vector<std::string> remarks;
  const auto add = [&](uint64_t count, const char* what) {
    if (count > 0) remarks.push_back(fmt::format("{} {}", count, what));
  };
  add(lost_, "states were not recorded, for want of room; the frames between are interpolated");
  add(damaged_, "parts of the recording are damaged and left out");
  add(replay_->stats().rejected_frames, "recorded frames could not be decoded");
  add(reader_->info().cut_bytes, "bytes at its end are of a part that was not written whole");
  return remarks;
}

}  // namespace strandcast
