#include "common/client/datagram_sender.h"

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <utility>

namespace strandcast {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

struct DatagramSender::State {
  asio::io_context io;
  udp::socket socket{io};
  udp::endpoint to;
};

DatagramSender::DatagramSender(std::unique_ptr<State> state) : state_(std::move(state)) {}
DatagramSender::~DatagramSender() = default;

Result<std::unique_ptr<DatagramSender>> DatagramSender::open(const Address& to) {
  auto state = std::make_unique<State>();
  error_code error;
  const auto found = udp::resolver(state->io).resolve(to.host, std::to_string(to.port), error);
  if (error || found.empty())
    return make_error(ErrorCode::NotFound, "no address is known for {}: {}", to.host, error.message());
  // "localhost" has one of each kind: servers listen on that of IPv4.
  state->to = found.begin()->endpoint();
  for (const auto& one : found)
    if (one.endpoint().protocol() == udp::v4()) state->to = one.endpoint();
  state->socket.open(state->to.protocol(), error);
  if (!error) state->socket.non_blocking(true, error);
  if (error)
    return make_error(ErrorCode::Unavailable, "cannot send to {}: {}", to.to_string(), error.message());
  return std::unique_ptr<DatagramSender>(new DatagramSender(std::move(state)));
}

bool DatagramSender::send(std::span<const std::byte> bytes) {
  error_code error;
  state_->socket.send_to(asio::buffer(bytes.data(), bytes.size()), state_->to, 0, error);
  return !error;
}

}  // namespace strandcast
