#include "client/app/way_out.h"

#include "common/client/reconnect_policy.h"

namespace strandcast {
namespace {

std::string of_upgrade(const Error& error, const Address& address) {
  if (error.code == ErrorCode::Unavailable) return {};  // busy: it says so itself
  if (error.code == ErrorCode::NotFound && !address.session.empty()) return "look at the name of the session";
  if (error.code == ErrorCode::Unauthorized)
    return "when it is no strandcast-server that says so, look at the port";
  return address.is_tls ? "something else than strandcast-server answers there: look at the port"
                        : "something else than strandcast-server answers there: look at the port; a server "
                          "that was started with --tls-cert is reached by wss://" +
                              address.to_string();
}

std::string of_welcome(const Error& error) {
  switch (error.code) {
    case ErrorCode::Unauthorized:
      return "--token-file FILE or the variable STRANDCAST_TOKEN gives the server's token";
    case ErrorCode::BadInput:
      return "use the viewer and the server of one version";
    case ErrorCode::LimitExceeded:
      return "close another viewer, or raise the server's limit of sessions";
    case ErrorCode::Unsupported:
      return is_refusal(error) ? "--view-only asks for a viewer's role, which most tokens are good for"
                               : "use the viewer and the server of one version";
    case ErrorCode::NotFound:
      return "look at the name of the head";
    default:
      return {};
  }
}

}  // namespace

bool is_refusal(const Error& error) {
  return error.message.starts_with(kClosedByServer);
}

std::string way_out(const Error& error, ConnectStep step, const Address& address) {
  switch (step) {
    case ConnectStep::FindHost:
      return "look at the name's spelling, or give the address in numbers";
    case ConnectStep::Connect:
      return "start strandcast-server there, and look at address, port and firewall; it listens on loopback "
             "only unless --listen says otherwise";
    case ConnectStep::BeginTls:
      if (error.code == ErrorCode::Unauthorized) return {};  // names --tls-ca itself
      return "the server may speak no TLS: leave out wss://, --tls and --tls-ca, or look at the port";
    case ConnectStep::AskForWebSocket:
      return of_upgrade(error, address);
    case ConnectStep::AwaitWelcome:
      return of_welcome(error);
  }
  return {};
}

}  // namespace strandcast
