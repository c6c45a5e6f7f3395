//! Linux SocketCAN.
