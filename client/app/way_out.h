// Remedies for a connection that failed or was lost, as text for a person. Pure, any thread.
#pragma once

#include <string>

#include "common/client/viewer_client.h"

namespace strandcast {

/// Returns whether the server itself refused or ended the session, giving its own reason.
bool is_refusal(const Error& error);

/// Returns a remedy in one sentence without a full stop; empty if only waiting helps. `step` is the stage
/// that the connection had reached.
std::string way_out(const Error& error, ConnectStep step, const Address& address);

}  // namespace strandcast
