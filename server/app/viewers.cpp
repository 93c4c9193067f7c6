#include "server/app/viewers.h"

#include <algorithm>
#include <utility>

#include "common/base/text.h"

namespace strandcast {

namespace {

/// H.264 has even sizes only, and the ladder halves them.
constexpr uint32_t kH264SizeStep = 4;

/// What a client decodes and this server encodes that moves with the fewest bytes.
PictureCodec best_codec(PictureCodecs decodable, const RenderSize& size) {
  PictureCodecs usable = decodable & encodable_picture_codecs();
  if (size.width % kH264SizeStep != 0 || size.height % kH264SizeStep != 0)
    usable &= ~codec_bit(PictureCodec::H264);
  for (const PictureCodec codec : {PictureCodec::H264, PictureCodec::Vp8, PictureCodec::JpegTiles})
    if ((usable & codec_bit(codec)) != 0) return codec;
  return PictureCodec::Jpeg;
}

RenderSize size_of(const SceneDesc& scene) {
  return {scene.stream.frame_width, scene.stream.frame_height};
}

/// The scene's camera and quality at this size.
PictureView make_view(const SceneDesc& scene, const RenderSize& size, PictureCodecs decodable) {
  PictureView view;
  view.camera = scene.camera;
  view.size = size;
  view.quality = static_cast<int>(scene.stream.jpeg_quality);
  view.codec = best_codec(decodable, size);
  return view;
}

std::vector<double> costs_of(const std::vector<PictureStep>& ladder) {
  std::vector<double> costs;
  for (const PictureStep& step : ladder) costs.push_back(step.relative_cost);
  return costs;
}

}  // namespace

Viewers::Viewers(const SceneDesc& scene) : scene_(scene), views_(make_view(scene, size_of(scene), 0)) {}

Result<PictureClass> Viewers::assign_view(SessionId session, const Viewer& viewer, const PictureView& view) {
  const bool is_controller = viewer.role == Role::Controller || viewer.role == Role::Admin;
  return views_.assign({session, viewer.peer, is_controller}, view);
}

Result<Viewers::Place> Viewers::add(const Visitor& visitor, const Hello& hello) {
  Place place;
  Viewer viewer;
  viewer.role = hello.role;
  viewer.peer = visitor.peer;
  viewer.name = hello.name;
  viewer.wanted = hello.mode;
  place.size = size_of(scene_);
  if (hello.frame_width > 0) place.size.width = hello.frame_width;
  if (hello.frame_height > 0) place.size.height = hello.frame_height;
  viewer.size = place.size;
  viewer.view = make_view(scene_, place.size, hello.picture_codecs);
  viewer.ladder = make_picture_ladder(viewer.view.codec, viewer.view.quality);
  viewer.step = find_step(viewer.ladder, viewer.view.quality);
  if (hello.role == Role::Source) {
    place.reason = "a source gets no stream";
  } else if (hello.mode == StreamMode::Frames) {
    place.mode = StreamMode::Frames;
    place.reason = "frames were asked for";
    RETURN_IF_ERROR(validate(viewer.view));
    ASSIGN_OR_RETURN(place.picture_class, assign_view(visitor.session, viewer, viewer.view));
    place.picture_costs = costs_of(viewer.ladder);
    place.picture_step = viewer.step;
  } else {
    place.reason = hello.mode == StreamMode::Strands
                       ? "strands were asked for"
                       : "strands: one stream serves every camera, and nothing speaks against it yet";
  }
  viewer.mode = place.mode;
  viewers_[visitor.session] = viewer;
  count();
  return place;
}

void Viewers::remove(SessionId session) {
  views_.remove(session);
  viewers_.erase(session);
  count();
}

std::string Viewers::describe(SessionId session) const {
  const auto found = viewers_.find(session);
  if (found == viewers_.end()) return fmt::format("session {}", session);
  return fmt::format("session {} ({} '{}')", session, to_string(found->second.role),
                     one_line(found->second.name, kMaxNameChars));
}

Result<std::optional<PictureClass>> Viewers::set_camera(SessionId session, const CameraDesc& camera) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || found->second.role == Role::Source)
    return make_error(ErrorCode::NotFound, "only viewers have a camera");
  Viewer& viewer = found->second;
  PictureView view = viewer.view;
  view.camera = camera;
  std::optional<PictureClass> picture_class;
  if (viewer.gets(StreamMode::Frames)) {
    RETURN_IF_ERROR(validate(view));
    ASSIGN_OR_RETURN(picture_class, assign_view(session, viewer, view));
  }
  viewer.view = view;
  return picture_class;
}

void Viewers::set_report(SessionId session, const ViewerReport& report) {
  const auto found = viewers_.find(session);
  if (found != viewers_.end()) found->second.report = report;
}

ViewerReport Viewers::report(SessionId session) const {
  const auto found = viewers_.find(session);
  return found != viewers_.end() ? found->second.report : ViewerReport{};
}

void Viewers::request_mode(SessionId session, StreamMode mode) {
  const auto found = viewers_.find(session);
  if (found != viewers_.end()) found->second.request = mode;
}

std::optional<ModeSwitch> Viewers::consider(SessionId session, const ModeFacts& facts, int64_t time_ns) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || found->second.role == Role::Source) return std::nullopt;
  Viewer& viewer = found->second;
  if (viewer.request && (viewer.request_ns == 0 || time_ns - viewer.request_ns >= kModeRequestNs)) {
    viewer.wanted = *std::exchange(viewer.request, std::nullopt);
    viewer.request_ns = time_ns;
    viewer.is_answer_due = true;
    viewer.policy = {};
  }
  if (viewer.next && time_ns - viewer.next_since_ns >= kModeChangeNs) {
    viewer.policy.note_failure(time_ns);
    return stay(session, fmt::format("{}: no first frame of the other mode came for {} s",
                                     to_string(viewer.mode), kModeChangeNs / 1'000'000'000));
  }
  const ModeChoice choice = choose(viewer, facts, time_ns);
  if (choice.mode == viewer.next.value_or(viewer.mode)) {
    const bool is_told_with_change = viewer.next.has_value();
    if (!std::exchange(viewer.is_answer_due, false) || is_told_with_change) return std::nullopt;
    return stay(session, choice.reason);
  }
  return begin_change(session, choice, time_ns);
}

/// What the viewer should get, given what it gets or is about to get.
ModeChoice Viewers::choose(Viewer& viewer, const ModeFacts& facts, int64_t time_ns) {
  if (viewer.wanted == StreamMode::Auto)
    return viewer.policy.choose(viewer.next.value_or(viewer.mode), facts, time_ns);
  if (viewer.wanted == StreamMode::Frames && !facts.paint_trouble.empty())
    return {StreamMode::Strands, "strands: no frames can be drawn here: " + facts.paint_trouble, 0};
  return {viewer.wanted, fmt::format("{} were asked for", to_string(viewer.wanted)),
          predict_strands(facts).strand_class};
}

std::optional<ModeSwitch> Viewers::begin_change(SessionId session, const ModeChoice& choice,
                                                int64_t time_ns) {
  Viewer& viewer = viewers_.at(session);
  // Back to what it has: the change under way is given up.
  if (choice.mode == viewer.mode) return stay(session, choice.reason);
  ModeSwitch change;
  change.change = {choice.mode, choice.reason, viewer.view.size.width, viewer.view.size.height};
  change.strand_class = static_cast<uint16_t>(choice.strand_class);
  if (choice.mode == StreamMode::Frames) {
    Status usable = validate(viewer.view);
    if (usable) {
      auto assigned = assign_view(session, viewer, viewer.view);
      usable = assigned ? Status() : assigned.error();
      if (assigned) change.picture_class = *assigned;
      change.picture_costs = costs_of(viewer.ladder);
      change.picture_step = viewer.step;
    }
    if (!usable) {
      viewer.policy.note_failure(time_ns);
      if (viewer.wanted == StreamMode::Frames) viewer.wanted = viewer.mode;
      return stay(session, "strands: no frames: " + usable.error().to_string());
    }
  }
  viewer.next = choice.mode;
  viewer.next_since_ns = time_ns;
  viewer.is_answer_due = false;
  count();
  return change;
}

ModeSwitch Viewers::stay(SessionId session, const std::string& reason) {
  Viewer& viewer = viewers_.at(session);
  if (viewer.next == StreamMode::Frames) views_.remove(session);
  viewer.next.reset();
  viewer.is_answer_due = false;
  count();
  ModeSwitch change;
  change.change = {viewer.mode, reason, viewer.view.size.width, viewer.view.size.height};
  return change;
}

void Viewers::set_mode(SessionId session, StreamMode mode, int64_t time_ns) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end()) return;
  Viewer& viewer = found->second;
  viewer.mode = mode;
  viewer.next.reset();
  if (mode == StreamMode::Strands) views_.remove(session);
  if (viewer.wanted == StreamMode::Auto) viewer.policy.note_change(time_ns);
  count();
}

Result<Viewers::Pictures> Viewers::set_picture_step(SessionId session, size_t step) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || !found->second.gets(StreamMode::Frames) ||
      step >= found->second.ladder.size())
    return make_error(ErrorCode::NotFound, "only viewers of frames have a quality of pictures");
  const auto [width, height] = found->second.size;
  const PictureStep& wanted = found->second.ladder[step];
  PictureView view = found->second.view;
  view.quality = wanted.quality;
  view.rate_divisor = wanted.rate_divisor;
  view.size.width = std::max(width / wanted.size_divisor, kMinPictureSide);
  view.size.height = std::max(height / wanted.size_divisor, kMinPictureSide);
  ASSIGN_OR_RETURN(const uint32_t picture_class, assign_view(session, found->second, view));
  found->second.view = view;
  found->second.step = step;
  return Pictures{picture_class, view};
}

std::optional<Viewers::Pictures> Viewers::pictures(SessionId session) const {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || !found->second.gets(StreamMode::Frames)) return std::nullopt;
  return Pictures{views_.class_of(session), found->second.view};
}

void Viewers::set_strand_class(SessionId session, uint16_t stream_id) {
  const auto found = viewers_.find(session);
  if (found != viewers_.end()) found->second.strand_class = stream_id;
}

uint32_t Viewers::strand_viewers(uint16_t stream_id) const {
  return static_cast<uint32_t>(std::count_if(viewers_.begin(), viewers_.end(), [&](const auto& item) {
    return item.second.gets(StreamMode::Strands) && item.second.strand_class == stream_id;
  }));
}

RenderSize Viewers::picture_size(SessionId session) const {
  const auto found = viewers_.find(session);
  return found != viewers_.end() ? found->second.view.size : RenderSize{};
}

RuntimeFacts Viewers::facts() const {
  RuntimeFacts facts;
  facts.strand_viewers = strand_viewers_;
  facts.frame_viewers = frame_viewers_;
  return facts;
}

void Viewers::count() {
  uint32_t strands = 0;
  uint32_t frames = 0;
  uint32_t all = 0;
  for (const auto& [session, viewer] : viewers_) {
    all += viewer.role != Role::Source ? 1 : 0;
    strands += viewer.gets(StreamMode::Strands) ? 1 : 0;
    frames += viewer.gets(StreamMode::Frames) ? 1 : 0;
  }
  strand_viewers_ = strands;
  frame_viewers_ = frames;
  viewer_count_ = all;
}

}  // namespace strandcast
