// Session: one WebSocket client from the opening handshake to the end. Network thread only; keeps itself
// alive while an operation is under way. Order of what it sends: Welcome, asset, keyframe, deltas.
#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/log/log.h"
#include "server/net/access.h"
#include "server/net/beast_private.h"
#include "server/net/context_private.h"
#include "server/net/flow_control.h"
#include "server/net/send_queue.h"

namespace strandcast::net {

class Session : public std::enable_shared_from_this<Session> {
 public:
  enum class State { Handshake, AwaitHello, Joined, Closing, Closed };

  Session(Context& context, SessionId id, NetStream stream, Peer peer);

  /// Answers the upgrade request. With `has_room` false the session gets a Goodbye and is closed.
  void start(http::request<http::empty_body> request, bool has_room);

  void deliver_strands(const EncodedFramePtr& frame);
  /// As SendQueue::offer_chain().
  void deliver_chain(const std::vector<EncodedFramePtr>& chain);
  /// The strand classes are others now: announces what this session gets.
  void follow_strand_classes(const std::string& reason);
  /// Strands have another shape: begins again with this asset, and a relay joins again.
  void renew_asset(const EncodedFramePtr& asset);
  /// Whether pictures of this class are for this session.
  bool watches(PictureClass picture_class) const;
  void deliver_picture(PictureClass picture_class, const PicturePtr& picture);
  /// Queues a control message; ignored before Welcome and while closing.
  void send(ServerMessage message);
  /// Goodbye with one sentence, then the closing handshake.
  void close(CloseCode code, const std::string& reason);
  /// Ends when its token no longer gives it its role.
  void check_stay();
  /// Ends what takes too long.
  void check_deadlines(int64_t time_ns);
  /// Drops the connection at once.
  void abort();

  State state() const { return state_; }
  /// Whether it has joined, and for this head.
  bool is_about(size_t head) const { return state_ == State::Joined && head_ == head; }
  /// For an admin's list.
  SessionInfo info(int64_t time_ns) const;
  const Peer& peer() const { return peer_; }
  int64_t received_ns() const { return received_ns_; }
  /// Whether a ping of ours has had no answer for kDoubtedNs, and nothing else came either.
  bool is_doubted(int64_t time_ns) const;
  /// Ends, since somebody else needs the place.
  void give_way();

 private:
  Head& head() const { return context_.heads[head_]; }
  bool is_relay() const { return !hello_.relay_id.empty(); }
  template <class Work>
  void guarded(Work&& work);
  void on_open(bool has_room);
  void read();
  void read_on();
  std::string rate_sentence() const;
  void on_read(const beast::error_code& error);
  void on_message(std::span<const std::byte> bytes, int64_t arrival_ns);
  bool check_token(const Hello& hello);
  void join(const Hello& hello);
  bool wait_with(const Hello& hello, const Error& trouble);
  void begin_media(const Hello& hello, const EncodedFramePtr& asset);
  void start_again(int64_t time_ns);
  void ask_for_anchor(int64_t time_ns);
  void dispatch(const ClientMessage& message, int64_t arrival_ns);
  void obey(const AdminCommand& command, int64_t time_ns);
  void move_camera(const CameraChange& camera);
  void follow_window(const WindowChange& window, int64_t time_ns);
  void reject(CloseCode code, const std::string& reason);
  void queue_control(ServerMessage message);
  void pump();
  void write_chunk();
  void on_written(const beast::error_code& error, size_t byte_count);
  void note_progress(int64_t time_ns);
  void start_close();
  void ask_for_keyframe(int64_t time_ns);
  void on_ack(const FrameAck& ack, int64_t time_ns);
  void adapt(int64_t time_ns);
  void change_strand_class(size_t chosen);
  void change_codec(const CodecAnswer& answer);
  void watch_asset(int64_t time_ns);
  void begin_strands(int64_t time_ns);
  void end_preview();
  void announce_quality(const std::string& reason);
  void follow_picture_class(PictureClass before);
  void answer_mode(const ModeAnswer& answer);
  void finish_mode_switch();
  void give_up_mode_change();
  void stop_other_mode();
  void report_link(int64_t time_ns);
  void adapt_pictures(int64_t time_ns);
  std::string describe_link(int64_t time_ns) const;
  void probe(int64_t time_ns);
  void on_control_frame(websocket::frame_type kind);
  std::string stall_reason(int64_t time_ns) const;
  void close_as_full();
  void account_drops();
  void leave();
  void finish();

  Context& context_;
  const SessionId id_;
  websocket::stream<NetStream> socket_;
  const Peer peer_;
  http::request<http::empty_body> request_;
  std::vector<std::byte> early_hello_;  // from the request; empty: it comes as a message
  State state_ = State::Handshake;
  std::optional<Hello> waiting_hello_;  // for what is away at the moment
  int64_t waiting_since_ns_ = 0;        // 0: it has not waited
  Hello hello_;                         // its token stays: it may be taken back
  int64_t token_expires_unix_s_ = 0;    // 0 = never
  size_t head_ = 0;                     // that it is about
  Subscription subscription_;
  std::string codec_;                        // name of that of its strands
  std::optional<ModeChange> untold_change_;  // goes right before the first frame of the next mode
  bool is_mode_request_waiting_ = false;
  int64_t status_sent_ns_ = 0;                 // the newest one
  bool has_asset_ = false;                     // sent, or next in line
  size_t asset_bytes_ = 0;                     // of the first one
  std::optional<Admission::Preview> preview_;  // until the first strands are asked for
  std::optional<CodecAnswer> after_preview_;   // until its keyframe is written, and the link is known
  bool is_asset_late_ = false;                 // a thin link, whatever it carries
  bool is_preview_written_ = false;
  bool has_joined_ = false;

  beast::flat_buffer read_buffer_{kMaxSessionReadBytes};
  RateLimit rate_;
  SendQueue queue_;
  FlowControl flow_;
  uint64_t sent_bytes_ = 0;
  uint64_t counted_drops_ = 0;
  uint64_t counted_losses_ = 0;

  std::vector<std::byte> control_bytes_;  // being written, or
  EncodedFramePtr media_;                 // this
  std::span<const std::byte> unwritten_;
  bool is_reading_held_ = false;
  bool is_writing_ = false;
  bool is_close_started_ = false;
  bool is_flooding_ = false;
  CloseCode close_code_ = CloseCode::Normal;
  int64_t state_since_ns_ = 0;
  int64_t progress_ns_ = 0;   // of the write under way
  size_t untaken_bytes_ = 0;  // when it was looked at last
  int64_t keyframe_asked_ns_ = 0;
  int64_t anchor_asked_ns_ = 0;
  int64_t link_reported_ns_ = 0;
  int64_t received_ns_ = 0;          // the newest message
  int64_t probe_sent_ns_ = 0;        // the newest WebSocket ping of ours
  bool is_probe_under_way_ = false;  // not yet answered
};

/// An exception ends this session only.
template <class Work>
void Session::guarded(Work&& work) {
  try {
    work();
  } catch (const std::exception& exception) {
    log_error("net", "session {}: {}", id_, exception.what());
    if (state_ == State::Closing) return abort();
    close(CloseCode::Internal, "The server failed to handle this session.");
  }
}

}  // namespace strandcast::net
