from .link import open_link as open_link
from .offboard import stream as stream
from .setpoints import FeedForward as FeedForward
from .stream_options import SafetyRules as SafetyRules
from .stream_options import StreamOptions as StreamOptions
from .stream_options import StreamReport as StreamReport
from .stream_options import StreamStatus as StreamStatus
from .streaming import Streamer as Streamer
