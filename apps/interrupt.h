// Ctrl-C as a request to stop at the next safe place.

#pragma once

namespace haarlight {

/// From here on SIGINT and SIGTERM set a flag; a second one ends the program at once, as usual.
void catch_interrupts();

/// Whether one has come since.
bool interrupted();

}  // namespace haarlight
