// The public header, as the library itself includes it.
#pragma once

#define MINSNAP_BUILD
#include "minsnap.h"
