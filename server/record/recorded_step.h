// A step as the simulation takes it, and as a recording has it. Pure functions, any thread.
#pragma once

#include "common/wire/recording_messages.h"
#include "server/source/step_tap.h"

namespace strandcast {

RecordedStep to_recorded(const TakenStep& step);
TakenStep to_taken(const RecordedStep& step);

}  // namespace strandcast
