#include "server/app/viewers.h"

#include <algorithm>
#include <utility>

#include "common/base/text.h"
#include "common/log/log.h"

namespace strandcast {

namespace {

/// H.264 has even sizes only, and the ladder halves them.
constexpr uint32_t kH264SizeStep = 4;

/// What a client decodes and this server encodes that moves with the fewest bytes.
PictureCodec best_codec(PictureCodecs decodable, const RenderSize& size) {
  PictureCodecs usable = decodable;
  if (size.width % kH264SizeStep != 0 || size.height % kH264SizeStep != 0)
    usable &= ~codec_bit(PictureCodec::H264);
  // What is encodable is asked for H.264 alone: that loads its library.
  if ((usable & codec_bit(PictureCodec::H264)) != 0) usable &= encodable_picture_codecs();
  for (const PictureCodec codec : {PictureCodec::H264, PictureCodec::Vp8, PictureCodec::JpegTiles})
    if ((usable & codec_bit(codec)) != 0) return codec;
  return PictureCodec::Jpeg;
}

/// Empty where the size is as wished.
std::string fitted_text(const RenderSize& wished, const RenderSize& fitted) {
  if (fitted.width == wished.width) return {};
  return fmt::format("; without a GPU this server draws {} x {} instead of {} x {} pixels", fitted.width,
                     fitted.height, wished.width, wished.height);
}

/// That a step of the ladder has.
RenderSize size_at(const RenderSize& size, const PictureStep& step) {
  return {std::max(size.width / step.size_divisor, kMinPictureSide),
          std::max(size.height / step.size_divisor, kMinPictureSide)};
}

std::vector<double> costs_of(const std::vector<PictureStep>& ladder) {
  std::vector<double> costs;
  for (const PictureStep& step : ladder) costs.push_back(step.relative_cost);
  return costs;
}

}  // namespace

RenderSize scene_picture_size(const SceneDesc& scene) {
  return {scene.stream.frame_width, scene.stream.frame_height};
}

PictureView make_scene_view(const SceneDesc& scene, const RenderSize& size, PictureCodecs decodable) {
  PictureView view;
  view.camera = scene.camera;
  view.size = size;
  view.quality = static_cast<int>(scene.stream.jpeg_quality);
  view.codec = best_codec(decodable, size);
  return view;
}

/// What the viewer gets, and during a change what it is about to get as well.
Demand Viewers::demand_of(const Viewer& viewer, const Subscription& wanted, const PictureView& view) {
  Demand demand;
  demand.awaits_picture = wanted.is_hidden() && wanted.gets(StreamMode::Frames);
  if (wanted.is_hidden()) return demand;
  demand.hair_px = viewer.report.hair_px;
  if (wanted.gets(StreamMode::Strands)) demand.strand_stream = stream_id_of(wanted.strands);
  if (wanted.gets(StreamMode::Frames)) demand.picture = view;
  return demand;
}

/// On an error the viewer stays as it was.
Status Viewers::change(Viewer& viewer, Subscription wanted, const PictureView& view) {
  ASSIGN_OR_RETURN(wanted.pictures.picture_class,
                   demand_sink_.set_demand(viewer.reader, demand_of(viewer, wanted, view)));
  *viewer.subscription = std::move(wanted);
  viewer.view = view;
  return {};
}

/// To something that takes no more than before.
void Viewers::change_surely(Viewer& viewer, const Subscription& wanted) {
  if (const Status status = change(viewer, wanted, viewer.view); !status)
    log_error("app", "a viewer that gives up something: {}", status.error().to_string());
}

Result<Viewers::Place> Viewers::add(SessionId session, ReaderId reader, Subscription& subscription,
                                    const Hello& hello) {
  Place place;
  Viewer viewer;
  viewer.role = hello.role;
  viewer.name = hello.name;
  viewer.keeps_camera = hello.keeps_camera;
  viewer.reader = reader;
  viewer.subscription = &subscription;
  viewer.wanted = hello.mode;
  RenderSize wished = scene_picture_size(scene_);
  if (hello.frame_width > 0) wished.width = hello.frame_width;
  if (hello.frame_height > 0) wished.height = hello.frame_height;
  place.size = fit_picture(wished, demand_sink_.picture_budget());
  viewer.size = place.size;
  viewer.view = make_scene_view(scene_, place.size, hello.picture_codecs);
  viewer.ladder = make_picture_ladder(viewer.view.codec, viewer.view.quality);
  Subscription wanted = subscription;
  wanted.pictures.costs = costs_of(viewer.ladder);
  wanted.pictures.step = find_step(viewer.ladder, viewer.view.quality);
  if (wanted.is_empty()) {
    place.reason = hello.gets_no_stream ? "no stream was asked for" : "a source gets no stream";
  } else if (hello.mode == StreamMode::Frames) {
    wanted.start_with(StreamMode::Frames);
    place.reason = "pictures were asked for";
    place.reason += fitted_text(wished, place.size);
  } else {
    place.reason = hello.mode == StreamMode::Strands
                       ? "strands were asked for"
                       : "strands: one stream serves every camera, and nothing speaks against it yet";
  }
  RETURN_IF_ERROR(change(viewer, wanted, viewer.view));
  viewers_[session] = viewer;
  count();
  return place;
}

ReaderId Viewers::remove(SessionId session) {
  const auto found = viewers_.find(session);
  const ReaderId reader = found != viewers_.end() ? found->second.reader : 0;
  viewers_.erase(session);
  count();
  return reader;
}

std::string Viewers::describe(SessionId session) const {
  const auto found = viewers_.find(session);
  if (found == viewers_.end()) return fmt::format("session {}", session);
  const Viewer& viewer = found->second;
  return fmt::format("session {} ({} '{}'{}{})", session, to_string(viewer.role),
                     one_line(viewer.name, kMaxNameChars), viewer.address.empty() ? "" : " from ",
                     viewer.address);
}

void Viewers::note_address(SessionId session, const std::string& address) {
  if (const auto found = viewers_.find(session); found != viewers_.end()) found->second.address = address;
}

Status Viewers::set_camera(SessionId session, const CameraDesc& camera) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || found->second.subscription->is_empty())
    return make_error(ErrorCode::NotFound, "only viewers have a camera");
  PictureView view = found->second.view;
  view.camera = camera;
  return change(found->second, *found->second.subscription, view);
}

Result<std::string> Viewers::set_window(SessionId session, const WindowChange& window) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || found->second.subscription->is_empty())
    return make_error(ErrorCode::NotFound, "only viewers have a window");
  Viewer& viewer = found->second;
  RenderSize wished = viewer.size;
  if (window.frame_width > 0) wished.width = window.frame_width;
  if (window.frame_height > 0) wished.height = window.frame_height;
  RenderSize size = fit_picture(wished, demand_sink_.picture_budget());
  if (viewer.view.codec == PictureCodec::H264)
    size = {size.width - size.width % kH264SizeStep, size.height - size.height % kH264SizeStep};
  PictureView view = viewer.view;
  Subscription wanted = *viewer.subscription;
  view.size = size_at(size, viewer.ladder[wanted.pictures.step]);
  // What nobody sees cannot become ready.
  const bool gives_up_change = window.is_hidden && wanted.next();
  if (gives_up_change) wanted.give_up_change();
  wanted.set_hidden(window.is_hidden);
  RETURN_IF_ERROR(change(viewer, std::move(wanted), view));
  viewer.is_answer_due |= gives_up_change;
  viewer.size = size;
  return "the window has another size" + fitted_text(wished, size);
}

Result<Viewers::Aimed> Viewers::aimed_at(SessionId by, SessionId whose) const {
  constexpr size_t kMaxNamed = 16;
  Aimed aimed;
  std::string others;
  size_t named = 0;
  for (const auto& [session, viewer] : viewers_) {
    if (viewer.subscription->is_empty()) continue;
    if (++named <= kMaxNamed) others += fmt::format("{}{}", others.empty() ? "" : ", ", session);
    if (whose == 0 ? session == by : session != whose) continue;
    (viewer.keeps_camera ? aimed.own : aimed.movable).push_back(session);
  }
  if (!aimed.movable.empty() || !aimed.own.empty()) return aimed;
  if (whose == 0)
    return make_error(ErrorCode::NotFound, "Nobody views this server{}.", named > 0 ? " but you" : "");
  return make_error(ErrorCode::NotFound, "No session {} views this server; {}.", whose,
                    others.empty() ? "nobody does" : "those that do: " + others);
}

void Viewers::set_report(SessionId session, const ViewerReport& report) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end()) return;
  const double before_px = std::exchange(found->second.report, report).hair_px;
  if (before_px != report.hair_px) change_surely(found->second, *found->second.subscription);
}

ViewerReport Viewers::report(SessionId session) const {
  const auto found = viewers_.find(session);
  return found != viewers_.end() ? found->second.report : ViewerReport{};
}

void Viewers::request_mode(SessionId session, StreamMode mode) {
  const auto found = viewers_.find(session);
  if (found != viewers_.end() && !found->second.subscription->is_empty()) found->second.request = mode;
}

bool Viewers::has_request(SessionId session) const {
  const auto found = viewers_.find(session);
  return found != viewers_.end() && found->second.request.has_value();
}

std::optional<ModeChange> Viewers::consider(SessionId session, const ModeFacts& facts, int64_t time_ns) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || found->second.subscription->is_empty()) return std::nullopt;
  Viewer& viewer = found->second;
  if (viewer.request && (viewer.request_ns == 0 || time_ns - viewer.request_ns >= kModeRequestNs)) {
    viewer.wanted = *std::exchange(viewer.request, std::nullopt);
    viewer.request_ns = time_ns;
    viewer.is_answer_due = true;
    viewer.policy = {};
  }
  const Subscription& present = *viewer.subscription;
  if (present.next() && time_ns - present.changing_since_ns() >= kModeChangeNs) {
    viewer.policy.note_failure(time_ns);
    return stay(viewer, fmt::format("{}: no first frame of the other mode came for {} s",
                                    to_string(present.mode()), kModeChangeNs / 1'000'000'000));
  }
  const ModeChoice choice = choose(viewer, facts, time_ns);
  if (choice.mode == present.next().value_or(present.mode())) {
    const bool is_told_with_change = present.next().has_value();
    if (!std::exchange(viewer.is_answer_due, false) || is_told_with_change) return std::nullopt;
    return stay(viewer, choice.reason);
  }
  return begin_change(viewer, choice, time_ns);
}

/// What the viewer should get, given what it gets or is about to get.
ModeChoice Viewers::choose(Viewer& viewer, const ModeFacts& facts, int64_t time_ns) {
  const Subscription& present = *viewer.subscription;
  if (viewer.wanted == StreamMode::Auto)
    return viewer.policy.choose(present.next().value_or(present.mode()), facts, time_ns);
  if (viewer.wanted == StreamMode::Frames && !facts.paint_trouble.empty())
    return {StreamMode::Strands, "strands: no pictures can be drawn here: " + facts.paint_trouble, 0};
  return {viewer.wanted,
          viewer.wanted == StreamMode::Frames ? "pictures were asked for" : "strands were asked for",
          predict_strands(facts).strand_class};
}

ModeChange Viewers::begin_change(Viewer& viewer, const ModeChoice& choice, int64_t time_ns) {
  // Back to what it has: the change under way is given up.
  if (choice.mode == viewer.subscription->mode()) return stay(viewer, choice.reason);
  Subscription wanted = *viewer.subscription;
  wanted.begin_change(choice.mode, time_ns);
  if (choice.mode == StreamMode::Strands) wanted.strands.strand_class = choice.strand_class;
  if (const Status usable = change(viewer, wanted, viewer.view); !usable) {
    viewer.policy.note_failure(time_ns);
    if (viewer.wanted == StreamMode::Frames) viewer.wanted = viewer.subscription->mode();
    return stay(viewer, "strands: no pictures: " + usable.error().to_string());
  }
  viewer.is_answer_due = false;
  return {choice.mode, choice.reason, viewer.view.size.width, viewer.view.size.height};
}

ModeChange Viewers::stay(Viewer& viewer, const std::string& reason) {
  Subscription wanted = *viewer.subscription;
  wanted.give_up_change();
  change_surely(viewer, wanted);
  viewer.is_answer_due = false;
  return {wanted.mode(), reason, viewer.view.size.width, viewer.view.size.height};
}

void Viewers::note_mode(SessionId session, int64_t time_ns) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end()) return;
  Viewer& viewer = found->second;
  change_surely(viewer, *viewer.subscription);
  if (viewer.wanted == StreamMode::Auto) viewer.policy.note_change(time_ns);
}

Result<Viewers::Pictures> Viewers::set_picture_step(SessionId session, size_t step) {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || !found->second.gets(StreamMode::Frames) ||
      step >= found->second.ladder.size())
    return make_error(ErrorCode::NotFound, "only viewers of pictures have a quality of them");
  Viewer& viewer = found->second;
  const PictureStep& row = viewer.ladder[step];
  PictureView view = viewer.view;
  view.quality = row.quality;
  view.rate_divisor = row.rate_divisor;
  view.size = size_at(viewer.size, row);
  Subscription wanted = *viewer.subscription;
  wanted.pictures.step = step;
  RETURN_IF_ERROR(change(viewer, std::move(wanted), view));
  return Pictures{viewer.subscription->pictures.picture_class, viewer.view};
}

std::optional<Viewers::Pictures> Viewers::pictures(SessionId session) const {
  const auto found = viewers_.find(session);
  if (found == viewers_.end() || !found->second.gets(StreamMode::Frames)) return std::nullopt;
  return Pictures{found->second.subscription->pictures.picture_class, found->second.view};
}

void Viewers::note_strand_class(SessionId session) {
  const auto found = viewers_.find(session);
  if (found != viewers_.end()) change_surely(found->second, *found->second.subscription);
}

bool Viewers::is_hidden(SessionId session) const {
  const auto found = viewers_.find(session);
  return found != viewers_.end() && found->second.subscription->is_hidden();
}

RenderSize Viewers::picture_size(SessionId session) const {
  const auto found = viewers_.find(session);
  return found != viewers_.end() ? found->second.view.size : RenderSize{};
}

void Viewers::count() {
  viewer_count_ =
      static_cast<uint32_t>(std::count_if(viewers_.begin(), viewers_.end(), [](const auto& entry) {
        return !entry.second.subscription->is_empty();
      }));
}

}  // namespace strandcast
