#include "haptics/tool_input.h"
