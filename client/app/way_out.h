// What a person can do about a connection that could not be made or was lost. Pure, any thread.
#pragma once

#include <string>

#include "common/client/viewer_client.h"

namespace strandcast {

/// The server itself refused or ended the session, in words of its own.
bool is_refusal(const Error& error);

/// One sentence without a full stop; empty when there is nothing but waiting. `step` is what the connection
/// was at.
std::string way_out(const Error& error, ConnectStep step, const Address& address);

}  // namespace strandcast
