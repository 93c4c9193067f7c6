// The part of Session that takes frames for its viewer and fits them to the link: acknowledgements,
// keyframes, strand classes, the ladder of pictures, and the change between strands and frames.
#include <algorithm>
#include <utility>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "server/net/session_private.h"

namespace strandcast::net {
namespace {

/// A link that carries the asset for so long carries the keyframe of all strands a little longer.
constexpr int64_t kThinAssetNs = 400 * kMsInNs;
constexpr int64_t kPreviewPatienceNs = 1'000 * kMsInNs;

}  // namespace

void Session::begin_media(const Hello& hello, const EncodedFramePtr& asset) {
  const EncodedFramePtr fitting = head().assets.fit(asset, hello.asset_layout);
  queue_.set_asset(fitting);
  has_asset_ = asset != nullptr;
  asset_bytes_ = has_asset_ ? fitting->message.size() : 0;
  if (is_relay()) queue_.take_all();
  if (subscription_.mode() == StreamMode::Strands) queue_.start_strands();
  if (subscription_.mode() == StreamMode::Frames) {
    queue_.start_pictures();
    // The first pictures are too small to show what the link carries.
    flow_.start_over(now_ns());
  }
  if (hello.acknowledges) flow_.expect_acks();
  flow_.remember_capacity_for(context_.config.limits.link_memory_ms * kMsInNs);
  probe(now_ns());
}

/// The client lost what it had.
void Session::start_again(int64_t time_ns) {
  queue_.lose_chain();
  if (subscription_.mode() == StreamMode::Frames || subscription_.changes_to(StreamMode::Frames))
    queue_.start_pictures();
  flow_.forget_in_flight();
  account_drops();
  ask_for_keyframe(time_ns);
}

void Session::renew_asset(const EncodedFramePtr& asset) {
  if (is_relay()) return close(CloseCode::GoingAway, "The hair has another shape: join again.");
  if (state_ != State::Joined || subscription_.is_empty()) return;
  guarded([&] {
    // Who sees pictures gets it with the next change to strands.
    if (!subscription_.gets(StreamMode::Strands))
      has_asset_ = false;
    else if (has_asset_)
      queue_.renew_asset(head().assets.fit(asset, hello_.asset_layout));
    if (subscription_.gets(StreamMode::Frames)) queue_.start_pictures();
    flow_.forget_in_flight();
    account_drops();
    ask_for_keyframe(now_ns());
    pump();
  });
}

/// A relay keeps what it had: the keyframe is for those who join there.
void Session::ask_for_anchor(int64_t time_ns) {
  const int64_t interval_ns = context_.config.limits.keyframe_interval_ms * kMsInNs;
  if (!subscription_.gets(StreamMode::Strands) ||
      (anchor_asked_ns_ != 0 && time_ns - anchor_asked_ns_ < interval_ns))
    return;
  anchor_asked_ns_ = time_ns;
  context_.count(&NetCounters::keyframe_requests);
  head().handler.on_need(id_, {StreamNeed::Kind::Anchor, stream_id_of(subscription_.strands)});
}

void Session::deliver_chain(const std::vector<EncodedFramePtr>& chain) {
  if (state_ != State::Joined || chain.empty() || subscription_.is_hidden() ||
      chain.front()->header.stream_id != stream_id_of(subscription_.strands))
    return;
  guarded([&] {
    if (queue_.offer_chain(chain) == SendQueue::Offer::Queued) finish_mode_switch();
    account_drops();
    pump();
  });
}

void Session::deliver_strands(const EncodedFramePtr& frame) {
  if (state_ != State::Joined || subscription_.is_hidden() ||
      frame->header.stream_id != stream_id_of(subscription_.strands))
    return;
  guarded([&] {
    const int64_t time_ns = now_ns();
    const SendQueue::Offer offer = queue_.offer_strands(frame);
    if (offer == SendQueue::Offer::LostChain) {
      flow_.on_chain_loss(time_ns);
      adapt(time_ns);
    }
    if (offer == SendQueue::Offer::Queued) finish_mode_switch();
    account_drops();
    pump();
  });
}

void Session::deliver_picture(PictureClass picture_class, const PicturePtr& picture) {
  // The keyframe of the strands that follow needs an empty pipe.
  if (!watches(picture_class) || subscription_.changes_to(StreamMode::Strands)) return;
  guarded([&] {
    const int64_t time_ns = now_ns();
    const uint64_t dropped = queue_.dropped_frames();
    const SendQueue::Offer offer = queue_.offer_picture(picture);
    if (offer == SendQueue::Offer::Queued && subscription_.changes_to(StreamMode::Frames)) {
      finish_mode_switch();
    } else if (queue_.dropped_frames() != dropped) {
      flow_.on_chain_loss(time_ns);
      adapt_pictures(time_ns);
    }
    account_drops();
    pump();
    ask_for_keyframe(time_ns);
  });
}

void Session::account_drops() {
  context_.count(&NetCounters::frames_dropped,
                 queue_.dropped_frames() - std::exchange(counted_drops_, queue_.dropped_frames()));
  context_.count(&NetCounters::chain_losses,
                 queue_.chain_losses() - std::exchange(counted_losses_, queue_.chain_losses()));
}

void Session::ask_for_keyframe(int64_t time_ns) {
  // The first picture of a change replaces what waits; other first frames need an empty pipe.
  const bool is_changing = subscription_.changes_to(StreamMode::Frames) && queue_.awaits_picture();
  const bool needs_picture =
      is_changing || (queue_.needs_picture() && !subscription_.changes_to(StreamMode::Strands));
  if (state_ != State::Joined || subscription_.is_hidden()) return;
  if (!(needs_picture || queue_.needs_keyframe())) return;
  if (!is_changing && !flow_.may_start(time_ns)) return;
  const int64_t interval_ns = context_.config.limits.keyframe_interval_ms * kMsInNs;
  if (after_preview_ && time_ns - keyframe_asked_ns_ > kPreviewPatienceNs) return end_preview();
  if (keyframe_asked_ns_ != 0 && time_ns - keyframe_asked_ns_ < interval_ns) return;
  if (!needs_picture) begin_strands(time_ns);
  keyframe_asked_ns_ = time_ns;
  context_.count(&NetCounters::keyframe_requests);
  if (needs_picture)
    head().handler.on_need(id_, {StreamNeed::Kind::Picture, 0, subscription_.pictures.picture_class});
  else
    head().handler.on_need(id_, {StreamNeed::Kind::Keyframe, stream_id_of(subscription_.strands)});
}

void Session::on_ack(const FrameAck& ack, int64_t time_ns) {
  flow_.on_ack(ack.stream_id, ack.sequence, time_ns, {ack.receive_time_ns, int64_t{ack.decode_us} * kUsInNs});
  if (after_preview_ && is_preview_written_) end_preview();
  adapt(time_ns);
  ask_for_keyframe(time_ns);
  pump();
}

std::string Session::describe_link(int64_t time_ns) const {
  return fmt::format("link {:.2f} Mbit/s, {:.0f} ms of data on its way",
                     flow_.capacity_bytes_per_s(time_ns) * 8e-6,
                     static_cast<double>(flow_.queue_delay_ns()) / kMsInNs);
}

/// Moves to another step of the ladder of pictures when the link says so.
void Session::adapt_pictures(int64_t time_ns) {
  if (state_ != State::Joined || subscription_.mode() != StreamMode::Frames || subscription_.next() ||
      !flow_.expects_acks())
    return;
  const PictureChoice& pictures = subscription_.pictures;
  const PictureClass before = pictures.picture_class;
  const size_t step = pictures.step;
  const double present = head().pictures.bytes_per_s(before);
  if (present <= 0.0 || pictures.costs.empty()) return;
  std::vector<double> costs;
  for (const double cost : pictures.costs) costs.push_back(present * cost / pictures.costs[step]);
  const double cap = context_.config.limits.viewer_bytes_per_s;
  const size_t chosen = flow_.choose_class({step, costs, cap}, time_ns);
  if (chosen == step) return;
  const char* why = chosen < step ? "the link has room" : "the link or this viewer is too slow";
  if (!head().handler.on_picture_step(id_, chosen, fmt::format("{}: {}", why, describe_link(time_ns))))
    return;
  head().pictures.forget(before);
  context_.count(&NetCounters::class_changes);
  follow_picture_class(before);
}

/// Moves to another strand class when the link says so. A relay has asked for the one that it needs.
void Session::adapt(int64_t time_ns) {
  if (is_relay() || subscription_.is_hidden() || after_preview_) return;
  if (subscription_.mode() == StreamMode::Frames) return adapt_pictures(time_ns);
  if (state_ != State::Joined || subscription_.mode() != StreamMode::Strands || !flow_.expects_acks()) return;
  const std::vector<double> costs = head().strands.bytes_per_s(subscription_.strands.codec);
  if (costs.empty()) return;
  const double cap = context_.config.limits.viewer_bytes_per_s;
  const size_t present = subscription_.strands.strand_class;
  const size_t chosen = flow_.choose_class({present, costs, cap, head().strands.classes()}, time_ns);
  if (chosen == present) return;
  change_strand_class(chosen);
  announce_quality(fmt::format("{}: {}; {}",
                               chosen < present ? "the link has room" : "the link or this viewer is too slow",
                               to_string(head().strands.classes()[chosen]), describe_link(time_ns)));
  ask_for_keyframe(time_ns);
}

void Session::change_strand_class(size_t chosen) {
  subscription_.strands.strand_class = chosen;
  context_.count(&NetCounters::class_changes);
  queue_.restart_strands();
  head().handler.on_change(id_, SubscriptionChange::Strands);
}

/// An asset that a proxy has taken shows nothing of the link until it is acknowledged. When that is late, a
/// few strands follow it all the same.
void Session::watch_asset(int64_t time_ns) {
  if (!flow_.awaits_asset()) return;
  flow_.on_asset_left(socket_.next_layer().untaken_bytes() + unwritten_.size(), time_ns);
  if (preview_) is_asset_late_ = flow_.pass_late_asset(kThinAssetNs, time_ns);
}

/// Over a thin link a few strands make the first picture: the keyframe of all is larger by twenty times.
void Session::begin_strands(int64_t time_ns) {
  const std::optional<Admission::Preview> preview = std::exchange(preview_, std::nullopt);
  if (!preview || !(is_asset_late_ || flow_.transfer_ns(asset_bytes_, time_ns) >= kThinAssetNs)) return;
  after_preview_ = {subscription_.strands.codec, codec_, {}};
  context_.count(&NetCounters::class_changes);
  subscription_.strands = preview->stream;
  codec_ = preview->codec;
  head().handler.on_change(id_, SubscriptionChange::Strands);
  announce_quality("a few strands first, since the link is thin");
}

void Session::end_preview() {
  keyframe_asked_ns_ = 0;
  change_codec(CodecAnswer(*after_preview_));
}

/// Strands go on by another codec, beginning with a keyframe.
void Session::change_codec(const CodecAnswer& answer) {
  if (state_ != State::Joined) return;
  const bool had_preview = std::exchange(after_preview_, std::nullopt).has_value();
  const StrandStream before = subscription_.strands;
  subscription_.strands.codec = answer.codec;
  codec_ = answer.name;
  context_.count(&NetCounters::codec_changes);
  const bool has_strands = subscription_.gets(StreamMode::Strands);
  const int64_t time_ns = now_ns();
  // Codecs differ in cost by far more than neighbouring classes do.
  const std::vector<double> costs = head().strands.bytes_per_s(answer.codec);
  if (!is_relay() && (had_preview || answer.codec == 0 || !costs.empty()))
    subscription_.strands.strand_class =
        flow_.begin_codec({subscription_.strands.strand_class, costs,
                           context_.config.limits.viewer_bytes_per_s, head().strands.classes()},
                          time_ns);
  const StrandClass& chosen = head().strands.classes()[subscription_.strands.strand_class];
  const std::string reason = had_preview && answer.reason.empty()
                                 ? fmt::format("after a first picture of few strands: {}; {}",
                                               to_string(chosen), describe_link(time_ns))
                                 : answer.reason;
  // A link that carries no more than a preview goes on with that.
  if (stream_id_of(subscription_.strands) == stream_id_of(before)) return announce_quality(reason);
  if (has_strands) queue_.restart_strands();
  head().handler.on_change(id_, SubscriptionChange::Strands);
  announce_quality(reason);
  if (has_strands) ask_for_keyframe(time_ns);
}

void Session::announce_quality(const std::string& reason) {
  context_.note(fmt::format("session {}: {}", id_, reason));
  const StrandClass& now = head().strands.classes()[subscription_.strands.strand_class];
  queue_control(StreamQuality{stream_id_of(subscription_.strands), now.rate_divisor, now.strand_share,
                              now.bound_m, reason, codec_});
}

void Session::follow_strand_classes(const std::string& reason) {
  const bool is_concerned =
      subscription_.mode() == StreamMode::Strands || subscription_.changes_to(StreamMode::Strands);
  if (state_ != State::Joined || !is_concerned || subscription_.is_empty()) return;
  guarded([&] {
    const size_t last = head().strands.classes().size() - 1;
    if (subscription_.strands.strand_class > last) change_strand_class(last);
    announce_quality(fmt::format("{}: {}", reason,
                                 to_string(head().strands.classes()[subscription_.strands.strand_class])));
    ask_for_keyframe(now_ns());
  });
}

void Session::report_link(int64_t time_ns) {
  const bool is_due = time_ns - link_reported_ns_ >= context_.config.limits.link_interval_ms * kMsInNs;
  if (subscription_.is_empty() || subscription_.is_hidden() || !(is_due || is_mode_request_waiting_)) return;
  link_reported_ns_ = time_ns;
  LinkState link;
  link.mode = subscription_.mode();
  link.strand_class = subscription_.strands.strand_class;
  link.capacity_bytes_per_s = flow_.capacity_bytes_per_s(time_ns);
  link.queue_delay_ms = static_cast<double>(flow_.queue_delay_ns()) / kMsInNs;
  context_.queue_delays.add_ms(link.queue_delay_ms);
  link.round_trip_ms = static_cast<double>(flow_.base_ns()) / kMsInNs;
  link.strand_bytes_per_s = head().strands.bytes_per_s(subscription_.strands.codec);
  const LinkAnswer answer = head().handler.on_link(id_, link, time_ns);
  is_mode_request_waiting_ = answer.is_request_waiting;
  if (answer.codec) change_codec(*answer.codec);
  if (answer.mode) answer_mode(*answer.mode);
}

// ---- the change between strands and frames: the old ones go on until the first new one is here ----

bool Session::watches(PictureClass picture_class) const {
  return state_ == State::Joined && !subscription_.is_empty() && subscription_.watches(picture_class);
}

/// The pictures of another class begin with a whole one.
void Session::follow_picture_class(PictureClass before) {
  if (subscription_.pictures.picture_class == before || !subscription_.gets(StreamMode::Frames)) return;
  queue_.start_pictures();
  account_drops();
  ask_for_keyframe(now_ns());
}

/// What was begun for the next mode stops.
void Session::give_up_mode_change() {
  if (std::exchange(untold_change_, std::nullopt)) stop_other_mode();
}

void Session::stop_other_mode() {
  if (subscription_.mode() == StreamMode::Strands)
    queue_.stop_pictures();
  else if (!queue_.stop_strands())
    has_asset_ = false;
}

void Session::answer_mode(const ModeAnswer& answer) {
  if (state_ != State::Joined || subscription_.is_empty()) return;
  if (!subscription_.next()) {
    give_up_mode_change();
    return queue_control(answer.change);
  }
  untold_change_ = answer.change;
  if (subscription_.changes_to(StreamMode::Frames)) {
    queue_.start_pictures();
  } else {
    if (!std::exchange(has_asset_, true))
      queue_.set_asset(head().assets.fit(answer.asset, hello_.asset_layout));
    queue_.start_strands();
  }
  ask_for_keyframe(now_ns());
  pump();
}

/// Called when a frame of the new mode is here: the old ones stop, and the client is told right before it.
void Session::finish_mode_switch() {
  if (!untold_change_) return;
  const ModeChange change = *std::exchange(untold_change_, std::nullopt);
  const int64_t time_ns = now_ns();
  subscription_.finish_change();
  flow_.start_over(time_ns);
  stop_other_mode();
  context_.count(&NetCounters::mode_changes);
  context_.note(fmt::format("session {} gets {}: {}", id_, to_string(subscription_.mode()), change.reason));
  head().handler.on_change(id_, SubscriptionChange::Mode);
  queue_control(change);
  if (subscription_.mode() == StreamMode::Frames || state_ != State::Joined) return;
  announce_quality(to_string(head().strands.classes()[subscription_.strands.strand_class]));
}

}  // namespace strandcast::net
