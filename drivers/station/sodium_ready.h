/// @file
#pragma once
namespace drivers::station {

/// Setup: before the first use of libsodium. May be called repeatedly and by several threads.
/// @throws SetupError if the library finds no source of random numbers.
void require_sodium();

}  // namespace drivers::station
