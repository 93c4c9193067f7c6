#include "tests/tools/load_viewers.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <map>
#include <span>
#include <utility>

#include "common/base/profile.h"
#include "common/codec/frame_header.h"

namespace strandcast::load {
namespace {

constexpr size_t kReadBytes = 256u << 10;
constexpr float kMsPerNs = 1e-6f;
constexpr int64_t kPingIntervalNs = 1'000'000'000;
// RFC 6455, section 5.2.
constexpr uint8_t kContinuation = 0x0, kBinary = 0x2, kClose = 0x8, kPing = 0x9;
constexpr uint8_t kFinal = 0x80, kMasked = 0x80, kOpcodeBits = 0x0f, kLengthBits = 0x7f;
constexpr uint8_t kTwoByteLength = 126, kEightByteLength = 127;

/// A client's frame; the mask is zero, which the standard allows and which changes nothing.
void append_frame(std::vector<std::byte>& out, uint8_t opcode, std::span<const std::byte> payload) {
  const auto put = [&](uint64_t value) { out.push_back(static_cast<std::byte>(value)); };
  put(kFinal | opcode);
  if (payload.size() < kTwoByteLength) {
    put(kMasked | payload.size());
  } else {
    put(kMasked | kTwoByteLength);
    put(payload.size() >> 8);
    put(payload.size());
  }
  for (int i = 0; i < 4; ++i) put(0);
  out.insert(out.end(), payload.begin(), payload.end());
}

using TlsSettings = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;
using TlsConnection = std::unique_ptr<SSL, decltype(&SSL_free)>;

Result<TlsSettings> make_settings(const Encryption& encryption) {
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes without MSG_NOSIGNAL
  TlsSettings settings(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
  const std::string file = encryption.authorities.string();
  const int trusted = file.empty() ? SSL_CTX_set_default_verify_paths(settings.get())
                                   : SSL_CTX_load_verify_locations(settings.get(), file.c_str(), nullptr);
  if (trusted != 1)
    return at(file, make_error(ErrorCode::BadInput, "cannot use these certificate authorities"));
  SSL_CTX_set_min_proto_version(settings.get(), TLS1_2_VERSION);
  SSL_CTX_set_verify(settings.get(), SSL_VERIFY_PEER, nullptr);
  SSL_CTX_set_mode(settings.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  return settings;
}

struct Viewer {
  ViewerPlan plan;
  int descriptor = -1;
  TlsConnection tls{nullptr, SSL_free};
  bool needs_input_to_write = false;  // the TLS handshake does
  bool is_upgraded = false;
  bool has_welcome = false;
  bool is_over = false;
  std::vector<std::byte> unsent;
  std::vector<std::byte> head;   // of the HTTP answer, then of the WebSocket frame under way
  std::vector<std::byte> begin;  // of the message under way: all of a control message, the header of media
  uint8_t frame_opcode = 0;
  bool is_frame_final = false;
  uint64_t frame_left = 0;         // payload bytes
  std::vector<std::byte> control;  // payload of a WebSocket control frame
  uint64_t message_bytes = 0;
  uint16_t stream_id = 0;
  uint32_t sequence = 0;
  int64_t frame_ns = 0;        // arrival of the newest strand frame or picture
  int64_t first_frame_ns = 0;  // and of the first
  bool has_chain = false;
};

}  // namespace

class LoadViewers::State {
 public:
  explicit State(const LoadConfig& config) : config_(config) {}
  ~State() {
    for (auto& [number, viewer] : viewers_) close(viewer.descriptor);
  }

  Result<uint64_t> join(const ViewerPlan& plan) {
    Viewer viewer;
    viewer.plan = plan;
    viewer.descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (viewer.descriptor < 0)
      return make_error(ErrorCode::Unavailable, "cannot open a socket: {}", std::strerror(errno));
    const int on = 1;
    setsockopt(viewer.descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(config_.port);
    if (inet_pton(AF_INET, config_.host.c_str(), &address.sin_addr) != 1) {
      close(viewer.descriptor);
      return make_error(ErrorCode::BadInput, "'{}' is no numeric IPv4 address", config_.host);
    }
    ::connect(viewer.descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address);
    if (config_.encryption) {
      if (const Status begun = begin_tls(viewer); !begun) {
        close(viewer.descriptor);
        return begun.error();
      }
    }
    const std::string request = fmt::format(
        "GET /v1 HTTP/1.1\r\nHost: {}:{}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: c3RyYW5kY2FzdC1sb2FkIQ==\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Protocol: {}\r\n\r\n",
        config_.host, config_.port, kWebSocketProtocol);
    const auto bytes = std::as_bytes(std::span(request));
    viewer.unsent.assign(bytes.begin(), bytes.end());
    viewers_.emplace(++last_number_, std::move(viewer));
    return last_number_;
  }

  void leave(uint64_t number, bool is_rude) {
    const auto found = viewers_.find(number);
    if (found == viewers_.end()) return;
    if (is_rude) {
      const linger now{1, 0};
      setsockopt(found->second.descriptor, SOL_SOCKET, SO_LINGER, &now, sizeof now);
    }
    close(found->second.descriptor);
    viewers_.erase(found);
  }

  void run_for(int64_t duration_ms) {
    const int64_t end_ns = now_ns() + duration_ms * 1'000'000;
    while (true) {
      const int64_t left_ms = (end_ns - now_ns()) / 1'000'000;
      if (left_ms < 0) return;
      turn(static_cast<int>(left_ms));
    }
  }

  std::map<uint64_t, Viewer> viewers_;
  LoadMeasures measures_;

 private:
  void turn(int wait_ms) {
    send_pings();
    std::vector<pollfd> waits;
    std::vector<uint64_t> numbers;
    for (const auto& [number, viewer] : viewers_) {
      const bool wants_read = viewer.plan.reads || !viewer.has_welcome;
      const bool wants_write = !viewer.unsent.empty() && !viewer.needs_input_to_write;
      const int events = (wants_read ? POLLIN : 0) | (wants_write ? POLLOUT : 0);
      waits.push_back({events == 0 ? -1 : viewer.descriptor, static_cast<short>(events), 0});
      numbers.push_back(number);
    }
    if (poll(waits.data(), waits.size(), wait_ms) <= 0) return;
    for (size_t i = 0; i < waits.size(); ++i) {
      if (waits[i].revents == 0) continue;
      Viewer& viewer = viewers_.at(numbers[i]);
      if ((waits[i].revents & (POLLIN | POLLHUP | POLLERR)) != 0) read(viewer);
      if (!viewer.is_over) write(viewer);
      if (!viewer.is_over) continue;
      close(viewer.descriptor);
      viewers_.erase(numbers[i]);
    }
  }

  /// As every client does: shows the server that somebody is there.
  void send_pings() {
    const int64_t time_ns = now_ns();
    if (time_ns - pinged_ns_ < kPingIntervalNs) return;
    pinged_ns_ = time_ns;
    for (auto& [number, viewer] : viewers_)
      if (viewer.has_welcome && viewer.plan.reads && viewer.plan.acknowledges)
        append_frame(viewer.unsent, kBinary, encode(ClientMessage(Ping{time_ns})));
  }

  void end(Viewer& viewer, uint16_t close_code) {
    if (std::exchange(viewer.is_over, true)) return;
    ++measures_.ended;
    ++measures_.close_codes[close_code];
  }

  Status begin_tls(Viewer& viewer) {
    if (settings_ == nullptr) {
      ASSIGN_OR_RETURN(settings_, make_settings(*config_.encryption));
    }
    viewer.tls.reset(SSL_new(settings_.get()));
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(viewer.tls.get()), config_.host.c_str());
    SSL_set_fd(viewer.tls.get(), viewer.descriptor);
    SSL_set_connect_state(viewer.tls.get());
    return {};
  }

  /// Bytes taken by the socket; 0: none now, negative: the connection is broken.
  static ssize_t send_some(Viewer& viewer) {
    if (viewer.tls == nullptr) {
      const ssize_t size = send(viewer.descriptor, viewer.unsent.data(), viewer.unsent.size(), MSG_NOSIGNAL);
      return size < 0 && (errno == EAGAIN || errno == ENOTCONN) ? 0 : size;
    }
    const int size =
        SSL_write(viewer.tls.get(), viewer.unsent.data(), static_cast<int>(viewer.unsent.size()));
    const int why = SSL_get_error(viewer.tls.get(), size);
    viewer.needs_input_to_write = size <= 0 && why == SSL_ERROR_WANT_READ;
    if (size > 0) return size;
    const bool is_too_early = why == SSL_ERROR_SYSCALL && errno == ENOTCONN;
    return why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE || is_too_early ? 0 : -1;
  }

  /// Bytes in the buffer; 0: none now, negative: the connection is over.
  ssize_t receive_some(Viewer& viewer) {
    if (viewer.tls == nullptr) {
      const ssize_t size = recv(viewer.descriptor, buffer_.data(), buffer_.size(), 0);
      if (size < 0 && (errno == EAGAIN || errno == EINTR)) return 0;
      return size == 0 ? -1 : size;
    }
    viewer.needs_input_to_write = false;
    const int size = SSL_read(viewer.tls.get(), buffer_.data(), static_cast<int>(buffer_.size()));
    if (size > 0) return size;
    const int why = SSL_get_error(viewer.tls.get(), size);
    return why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE ? 0 : -1;
  }

  void write(Viewer& viewer) {
    if (viewer.unsent.empty()) return;
    const ssize_t size = send_some(viewer);
    if (size < 0) return end(viewer, 0);
    viewer.unsent.erase(viewer.unsent.begin(), viewer.unsent.begin() + size);
  }

  void read(Viewer& viewer) {
    do {
      const ssize_t size = receive_some(viewer);
      if (size == 0) return;
      if (size < 0) return end(viewer, 0);
      std::span<const std::byte> bytes = std::span(buffer_).first(static_cast<size_t>(size));
      if (!viewer.is_upgraded) bytes = take_http(viewer, bytes);
      while (!bytes.empty() && !viewer.is_over) bytes = take_frame(viewer, bytes);
      // What TLS has decrypted already makes no socket readable.
    } while (!viewer.is_over && viewer.tls != nullptr && SSL_pending(viewer.tls.get()) > 0);
  }

  /// Consumes the answer to the upgrade; what follows it is WebSocket.
  std::span<const std::byte> take_http(Viewer& viewer, std::span<const std::byte> bytes) {
    constexpr std::string_view kEnd = "\r\n\r\n";
    constexpr size_t kMaxAnswerBytes = 8u << 10;
    viewer.head.insert(viewer.head.end(), bytes.begin(), bytes.end());
    const std::string_view text(reinterpret_cast<const char*>(viewer.head.data()), viewer.head.size());
    const size_t found = text.find(kEnd);
    if (found == std::string_view::npos) {
      if (text.size() > kMaxAnswerBytes) end(viewer, 0);
      return {};
    }
    if (!text.starts_with("HTTP/1.1 101")) {
      end(viewer, 0);
      return {};
    }
    const size_t rest = text.size() - found - kEnd.size();
    viewer.is_upgraded = true;
    viewer.head.clear();
    Hello hello;
    hello.mode = viewer.plan.mode;
    hello.name = "load";
    hello.token = config_.token;
    hello.acknowledges = viewer.plan.acknowledges;
    append_frame(viewer.unsent, kBinary, encode(ClientMessage(hello)));
    return bytes.last(rest);
  }

  /// Consumes a piece of a frame's header or payload.
  std::span<const std::byte> take_frame(Viewer& viewer, std::span<const std::byte> bytes) {
    if (viewer.frame_left == 0) {
      viewer.head.push_back(bytes[0]);
      if (is_head_complete(viewer)) begin_frame(viewer);
      return bytes.subspan(1);
    }
    const auto piece = bytes.first(std::min<uint64_t>(bytes.size(), viewer.frame_left));
    const bool is_control = viewer.frame_opcode >= kClose;
    std::vector<std::byte>& kept = is_control ? viewer.control : viewer.begin;
    const bool is_media = !is_control && !kept.empty() && static_cast<Opcode>(kept[0]) != Opcode::Control;
    size_t wanted = is_media ? kFrameHeaderBytes : kMaxControlBytes;
    if (!is_control && kept.empty() && static_cast<Opcode>(piece[0]) != Opcode::Control)
      wanted = kFrameHeaderBytes;
    const size_t take = std::min(piece.size(), wanted - std::min(wanted, kept.size()));
    kept.insert(kept.end(), piece.begin(), piece.begin() + static_cast<ptrdiff_t>(take));
    if (!is_control) viewer.message_bytes += piece.size();
    viewer.frame_left -= piece.size();
    if (viewer.frame_left == 0) end_frame(viewer);
    return bytes.subspan(piece.size());
  }

  static size_t length_bytes(const Viewer& viewer) {
    const auto length = std::to_integer<uint8_t>(viewer.head[1]) & kLengthBits;
    return length == kTwoByteLength ? 2 : length == kEightByteLength ? 8 : 0;
  }
  static bool is_head_complete(const Viewer& viewer) {
    return viewer.head.size() >= 2 && viewer.head.size() == 2 + length_bytes(viewer);
  }

  void begin_frame(Viewer& viewer) {
    const auto first = std::to_integer<uint8_t>(viewer.head[0]);
    viewer.frame_opcode = first & kOpcodeBits;
    viewer.is_frame_final = (first & kFinal) != 0;
    viewer.frame_left = std::to_integer<uint64_t>(viewer.head[1]) & kLengthBits;
    if (length_bytes(viewer) > 0) viewer.frame_left = 0;
    for (size_t i = 2; i < viewer.head.size(); ++i)
      viewer.frame_left = viewer.frame_left << 8 | std::to_integer<uint64_t>(viewer.head[i]);
    viewer.head.clear();
    if (viewer.frame_left == 0) end_frame(viewer);
  }

  void end_frame(Viewer& viewer) {
    if (viewer.frame_opcode >= kClose) {
      constexpr uint8_t kPong = 0xa;
      if (viewer.frame_opcode == kPing) append_frame(viewer.unsent, kPong, viewer.control);
      if (viewer.frame_opcode == kClose) {
        append_frame(viewer.unsent, kClose, viewer.control);
        write(viewer);
        const bool has_code = viewer.control.size() >= 2;
        end(viewer, has_code ? static_cast<uint16_t>(std::to_integer<unsigned>(viewer.control[0]) << 8 |
                                                     std::to_integer<unsigned>(viewer.control[1]))
                             : 0);
      }
      viewer.control.clear();
      return;
    }
    if (!viewer.is_frame_final) return;
    take_message(viewer);
    viewer.begin.clear();
    viewer.message_bytes = 0;
  }

  void take_message(Viewer& viewer) {
    if (viewer.begin.empty()) return;
    if (static_cast<Opcode>(viewer.begin[0]) == Opcode::Control) return take_control(viewer);
    if (viewer.begin.size() < kFrameHeaderBytes) return;
    FrameHeader header;
    const auto at = [&](size_t offset, auto& value) {
      std::memcpy(&value, viewer.begin.data() + offset, sizeof value);
    };
    header.opcode = static_cast<Opcode>(viewer.begin[0]);
    at(2, header.stream_id);
    at(4, header.sequence);
    at(8, header.base_sequence);
    at(24, header.send_time_ns);
    const int64_t time_ns = now_ns();
    if (viewer.plan.acknowledges)
      append_frame(viewer.unsent, kBinary,
                   encode(ClientMessage(FrameAck{header.sequence, time_ns, 0, header.stream_id})));
    measures_.bytes += viewer.message_bytes;
    if (header.opcode == Opcode::Asset) return;
    take_media(viewer, header, time_ns);
  }

  void take_media(Viewer& viewer, const FrameHeader& header, int64_t time_ns) {
    ++measures_.frames;
    const bool is_keyframe = header.opcode == Opcode::StrandKeyframe;
    measures_.keyframes += is_keyframe ? 1 : 0;
    if (header.opcode == Opcode::StrandDelta) {
      const bool continues =
          viewer.has_chain && header.stream_id == viewer.stream_id && header.base_sequence == viewer.sequence;
      measures_.chain_errors += continues ? 0 : 1;
    }
    viewer.has_chain = true;
    viewer.stream_id = header.stream_id;
    viewer.sequence = header.sequence;
    if (viewer.frame_ns != 0)
      measures_.interval_ms.push_back(static_cast<float>(time_ns - viewer.frame_ns) * kMsPerNs);
    viewer.frame_ns = time_ns;
    if (viewer.first_frame_ns == 0) viewer.first_frame_ns = time_ns;
    if (!is_keyframe)
      measures_.latency_ms.push_back(static_cast<float>(time_ns - header.send_time_ns) * kMsPerNs);
  }

  void take_control(Viewer& viewer) {
    const auto message = decode_server_message(viewer.begin);
    if (!message) return;
    if (std::holds_alternative<Welcome>(*message)) {
      viewer.has_welcome = true;
      ++measures_.joined;
    }
    if (const auto* quality = std::get_if<StreamQuality>(&*message)) {
      ++measures_.quality_changes;
      measures_.newest_quality = *quality;
      measures_.newest_quality_ms =
          viewer.first_frame_ns == 0 ? 0.0f : static_cast<float>(now_ns() - viewer.first_frame_ns) * kMsPerNs;
    }
    if (const auto* goodbye = std::get_if<Goodbye>(&*message)) measures_.last_goodbye = goodbye->reason;
  }

  const LoadConfig config_;
  TlsSettings settings_{nullptr, SSL_CTX_free};  // when the first viewer needs it
  uint64_t last_number_ = 0;
  int64_t pinged_ns_ = 0;
  std::array<std::byte, kReadBytes> buffer_{};
};

LoadViewers::LoadViewers(const LoadConfig& config) : state_(std::make_unique<State>(config)) {}
LoadViewers::~LoadViewers() = default;

Result<uint64_t> LoadViewers::join(const ViewerPlan& plan) {
  return state_->join(plan);
}
void LoadViewers::leave(uint64_t viewer, bool is_rude) {
  state_->leave(viewer, is_rude);
}
uint64_t LoadViewers::oldest() const {
  return state_->viewers_.empty() ? 0 : state_->viewers_.begin()->first;
}
void LoadViewers::run_for(int64_t duration_ms) {
  state_->run_for(duration_ms);
}
size_t LoadViewers::open_count() const {
  return state_->viewers_.size();
}
size_t LoadViewers::watching_count() const {
  return static_cast<size_t>(std::count_if(state_->viewers_.begin(), state_->viewers_.end(),
                                           [](const auto& item) { return item.second.frame_ns != 0; }));
}
const LoadMeasures& LoadViewers::measures() const {
  return state_->measures_;
}
void LoadViewers::reset_measures() {
  LoadMeasures fresh;
  fresh.newest_quality = state_->measures_.newest_quality;
  fresh.newest_quality_ms = state_->measures_.newest_quality_ms;
  state_->measures_ = std::move(fresh);
}

float quantile(std::vector<float> values, double share) {
  if (values.empty()) return 0.0f;
  const auto rank = static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<size_t>(rank)];
}

}  // namespace strandcast::load
