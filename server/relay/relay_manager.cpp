#include "server/relay/relay_manager.h"

#include <algorithm>
#include <utility>

#include "common/base/version.h"
#include "common/strands/strand_codec.h"
#include "server/app/process_metrics.h"
#include "server/net/metrics.h"

namespace strandcast {
namespace {

/// A codec that this build does not know is passed on like any other.
std::vector<StrandCodecInfo> codecs_of(const StreamList& streams) {
  std::vector<StrandCodecInfo> codecs;
  for (const std::string& name : streams.codecs) {
    Result<StrandCodecInfo> info = strand_codec_info(name);
    codecs.push_back(info ? std::move(info).value() : StrandCodecInfo{name, {}});
  }
  return codecs;
}

}  // namespace

void RelayManager::connect(NetServer& net) {
  net_ = &net;
  announcer_.connect(net);
}

void RelayManager::set_relayed(RelayedPtr relayed) {
  announcer_.change([&](StreamList& list) { list = relayed->streams; });
  const std::lock_guard lock(mutex_);
  relayed_ = std::move(relayed);
}

RelayedPtr RelayManager::relayed() const {
  const std::lock_guard lock(mutex_);
  return relayed_;
}

void RelayManager::move_views(const CameraChange& camera) {
  const std::lock_guard lock(mutex_);
  for (const SessionId session : movable_) net_->send(session, camera);
}

Status RelayManager::check(const Hello& hello, const Relayed& relayed) const {
  const auto& relays = relayed.welcome.relays;
  if (!hello.relay_id.empty() && std::find(relays.begin(), relays.end(), hello.relay_id) != relays.end())
    return make_error(ErrorCode::Unsupported,
                      "This relay stands behind yours: relays must not stand in a ring.");
  if (!hello.relay_id.empty() && hello.strand_class >= relayed.streams.classes.size())
    return make_error(ErrorCode::Unavailable, "There is no class {} of strands now.", hello.strand_class);
  const auto& heads = relayed.welcome.heads;
  if (hello.head.empty() || hello.head == relayed.welcome.scene_name) return {};
  if (parts_.has_all_heads && std::find(heads.begin(), heads.end(), hello.head) != heads.end())
    return make_error(ErrorCode::Unavailable, "Head '{}' has not come here yet: try again.", hello.head);
  return make_error(ErrorCode::NotFound, "There is no head called '{}' here: this relay passes on '{}'.",
                    hello.head, relayed.welcome.scene_name);
}

SimulatedModel RelayManager::model(const Relayed& relayed) const {
  const ServerStatus status = upstream_.status();
  return {relayed.streams.solver, relayed.streams.solver_cost, relayed.streams.substeps, status.is_paused,
          status.realtime_factor};
}

Result<Admission> RelayManager::on_hello(const Visitor& visitor, const Hello& hello) {
  if (hello.relay_id == parts_.id)
    return make_error(ErrorCode::Unsupported,
                      "This relay stands behind itself: its --upstream must be another server.");
  RETURN_IF_ERROR(upstream_.connected());
  const RelayedPtr relayed = this->relayed();
  if (relayed == nullptr) return make_error(ErrorCode::Unavailable, "This relay has just begun: try again.");
  RETURN_IF_ERROR(check(hello, *relayed));
  if (std::exchange(codecs_of_, relayed->welcome.session_id) != relayed->welcome.session_id)
    codecs_.emplace(
        CodecManager::Served{codecs_of(relayed->streams),
                             size_t{relayed->welcome.strand_count} * size_t{relayed->welcome.vertex_count},
                             relayed->welcome.step_rate_hz});
  Hello viewer = hello;
  if (hello.head.empty())
    viewer.head = upstream_.head();  // who named none is about all of them up there, too
  Subscription& subscription = visitor.subscription;
  const ViewerCodec codec = codecs_->admit(visitor.session, hello, model(*relayed));
  subscription.strands.codec = codec.codec;
  Admission admission{relayed->welcome, nullptr};
  Welcome& welcome = admission.welcome;
  welcome.relays.push_back(parts_.id);
  if (!parts_.has_all_heads) welcome.heads.clear();
  welcome.codec = relayed->streams.codecs[codec.codec];
  welcome.codec_reason = codec.reason;
  welcome.mode_reason = "strands: a relay passes them on to everybody";
  if (subscription.is_empty()) {
    welcome.mode_reason = "no stream was asked for";
  } else if (hello.mode == StreamMode::Frames) {
    subscription.start_with(StreamMode::Frames);
    subscription.pictures.picture_class = static_cast<PictureClass>(visitor.session);
    if (hello.frame_width > 0) welcome.frame_width = hello.frame_width;
    if (hello.frame_height > 0) welcome.frame_height = hello.frame_height;
    welcome.mode_reason = "pictures were asked for, and come through a relay";
    parts_.uplinks.open_pictures({visitor.session, viewer, visitor.peer}, number_);
  } else {
    admission.asset = relayed->asset;
  }
  if (!hello.relay_id.empty()) {
    subscription.strands.strand_class = hello.strand_class;
    announcer_.add(visitor.session);
  }
  leaves_[visitor.session] = {viewer, visitor.peer, &subscription, {}, false};
  follow_demand();
  if (!hello.keeps_camera && subscription.gets(StreamMode::Strands)) {
    const std::lock_guard lock(mutex_);
    movable_.insert(visitor.session);
  }
  return admission;
}

void RelayManager::say(SessionId session, const ClientMessage& message) {
  const auto found = leaves_.find(session);
  if (found != leaves_.end())
    parts_.uplinks.say({session, found->second.hello, found->second.address}, message);
}

void RelayManager::on_message(SessionId session, const ClientMessage& message, int64_t) {
  const auto found = leaves_.find(session);
  if (found == leaves_.end()) return;
  Leaf& leaf = found->second;
  std::visit(Overloaded{[&](const CameraChange&) {  // other viewers draw by themselves
                          if (leaf.subscription->gets(StreamMode::Frames)) say(session, message);
                        },
                        [&](const WindowChange& window) { follow_window(session, leaf, window); },
                        [&](const ViewerReport& report) { leaf.report = report; },
                        [&](const ModeRequest&) { leaf.is_answer_due = true; },
                        [&](const AdminCommand&) { is_shut_down_wanted_ = true; },  // all that comes here
                        [&](const auto&) { say(session, message); }},
             message);
}

/// What no window shows is not fetched either; pictures stop and change at the server above.
void RelayManager::follow_window(SessionId session, Leaf& leaf, const WindowChange& window) {
  if (window.frame_width > 0) leaf.hello.frame_width = window.frame_width;
  if (window.frame_height > 0) leaf.hello.frame_height = window.frame_height;
  leaf.subscription->set_hidden(window.is_hidden);
  if (leaf.subscription->gets(StreamMode::Frames)) say(session, window);
  follow_demand();
}

void RelayManager::on_need(SessionId session, const StreamNeed& need) {
  switch (need.kind) {
    case StreamNeed::Kind::Keyframe:
      return upstream_.join(session, need.stream_id);
    case StreamNeed::Kind::Anchor:
      return upstream_.request_keyframe(need.stream_id);
    case StreamNeed::Kind::Picture:
      return parts_.uplinks.request_picture(session);
  }
}

LinkAnswer RelayManager::on_link(SessionId session, const LinkState& link, int64_t time_ns) {
  LinkAnswer answer;
  const auto found = leaves_.find(session);
  const RelayedPtr relayed = this->relayed();
  if (found == leaves_.end() || relayed == nullptr) return answer;
  Leaf& leaf = found->second;
  if (std::exchange(leaf.is_answer_due, false))
    answer.mode = ModeAnswer{
        {link.mode, "behind a relay the mode is that of the beginning: join again for the other one",
         leaf.hello.frame_width, leaf.hello.frame_height},
        nullptr};
  const auto& classes = relayed->streams.classes;
  const double states_hz =
      link.strand_class < classes.size() ? classes[link.strand_class].frame_rate_hz : 0.0;
  const SimulatedModel model_now = model(*relayed);
  answer.codec = codecs_->consider(session, {link, leaf.report, model_now, states_hz}, time_ns);
  return answer;
}

/// What anybody needs is got once for all of them.
void RelayManager::follow_demand() {
  std::set<uint16_t> streams;
  uint32_t viewers = 0;
  for (const auto& [session, leaf] : leaves_) {
    if (leaf.subscription->gets(StreamMode::Strands) && !leaf.subscription->is_hidden())
      streams.insert(stream_id_of(leaf.subscription->strands));
    viewers += leaf.subscription->is_empty() ? 0 : 1;
  }
  viewer_count_ = viewers;
  upstream_.set_demand(std::move(streams));
}

void RelayManager::on_left(SessionId session) {
  {
    const std::lock_guard lock(mutex_);
    movable_.erase(session);
  }
  leaves_.erase(session);
  announcer_.remove(session);
  if (codecs_) codecs_->remove(session);
  parts_.uplinks.leave(session);
  follow_demand();
}

std::string RelayManager::metrics() {
  const UpstreamCounters counters = parts_.counters();
  const auto total = [](std::string_view name, const char* help, uint64_t value) {
    return format_metric(name, "counter", help, static_cast<double>(value));
  };
  const auto now = [](std::string_view name, const char* help, double value) {
    return format_metric(name, "gauge", help, value);
  };
  return format_build_info(version()) +
         now("relay_upstream_connected", "1 while the server above answers.",
             upstream_.connected() ? 1.0 : 0.0) +
         now("relay_upstream_streams", "Streams of strands that this relay gets.",
             static_cast<double>(counters.streams)) +
         now("relay_upstream_sessions",
             "Its sessions at the server above: those, and one for each viewer "
             "that says something or gets pictures.",
             static_cast<double>(counters.streams + parts_.uplinks.count())) +
         total("relay_received_bytes_total", "Payload of the streams.", counters.received_bytes) +
         total("relay_frames_total", "Strand frames passed on.", counters.frames) +
         total("relay_keyframes_total", "Keyframes among them.", counters.keyframes) +
         total("relay_keyframes_asked_total", "Keyframes asked of the server above.",
               counters.keyframes_asked) +
         total("relay_joins_from_chain_total", "Viewers that began with what the relay had.",
               counters.joins_from_chain) +
         total("relay_reconnects_total", "Times that the server above was found again.",
               counters.reconnects) +
         format_process_metrics();
}

}  // namespace strandcast
