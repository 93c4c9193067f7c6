// Converts steps between the simulation's form and that of a recording. Pure functions, any thread.
#pragma once

#include "common/wire/recording_messages.h"
#include "server/source/step_tap.h"

namespace strandcast {

RecordedStep to_recorded(const TakenStep& step);
TakenStep to_taken(const RecordedStep& step);

}  // namespace strandcast
